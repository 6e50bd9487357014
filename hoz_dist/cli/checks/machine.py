"""Checks of the machine: Python, packages, cores, memory."""

import importlib.metadata
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from hoz_dist.cli.checks.finding import Finding

GIB: Final = 2**30
LEAST_MEMORY_GIB: Final = 4
"""A learner and two actors of the compact preset, with room for their page cache."""
LEAST_SHARED_MEMORY_MIB: Final = 64
_REQUIREMENT = re.compile(r"(?P<name>[A-Za-z0-9._-]+)>=(?P<least>[0-9.]+)")
_CGROUP_LIMIT: Final = Path("/sys/fs/cgroup/memory.max")
_SHARED_MEMORY: Final = Path("/dev/shm")  # noqa: S108  # its size is looked at, nothing is written


def check_python() -> Finding:
    """Check the version of Python."""
    found = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    if sys.version_info[:2] == (3, 11):
        return Finding("python", "ok", found)
    return Finding("python", "fail", found, "Use Python 3.11: PyBullet has no wheels for later versions.")


def check_packages() -> Iterator[Finding]:
    """Check the packages that hoz-dist depends on: one finding in all when they are there, else one for each fault."""
    try:
        requirements = importlib.metadata.requires("hoz-dist") or []
    except importlib.metadata.PackageNotFoundError:
        yield Finding("packages", "warn", "hoz-dist itself is not installed", "Install it: pip install --editable .")
        return
    versions = []
    faults = 0
    for requirement in requirements:
        match = _REQUIREMENT.match(requirement)
        if match is None or "extra ==" in requirement:
            continue
        name, least = match["name"], match["least"].rstrip(".")
        try:
            version = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            faults += 1
            yield Finding("packages", "fail", f"{name} is missing", f"Install it: pip install '{name}>={least}'.")
            continue
        versions.append(f"{name} {version}")
        if _numbers(version) < _numbers(least):
            faults += 1
            yield Finding("packages", "fail", f"{name} {version} is too old", f"pip install '{name}>={least}'.")
    if not faults:
        yield Finding("packages", "ok", ", ".join(versions))


def check_cores() -> Finding:
    """Check how many processes can compute at once, and whether torch would compete with itself."""
    cores = len(os.sched_getaffinity(0))
    if cores >= 2:  # noqa: PLR2004  # one to learn, one to act
        return Finding("cores", "ok", f"{cores}; every process computes with one thread")
    return Finding("cores", "warn", "1", "The learner and the actors take turns; two or more train faster.")


def check_memory() -> Finding:
    """Check the memory that this process may use, in a container too."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    limit = _CGROUP_LIMIT.read_text().strip() if _CGROUP_LIMIT.exists() else "max"
    if limit.isdigit():
        total = min(total, int(limit))
    found = f"{total / GIB:.1f} GiB"
    if total >= LEAST_MEMORY_GIB * GIB:
        return Finding("memory", "ok", found)
    return Finding("memory", "warn", found, f"Run fewer actors; {LEAST_MEMORY_GIB} GiB suit a learner and two of them.")


def check_shared_memory() -> Finding:
    """Check /dev/shm, through which Zenoh can carry large messages between the processes of a machine."""
    if not _SHARED_MEMORY.is_dir():
        return Finding("shared memory", "ok", "none; Zenoh uses TCP")
    usage = shutil.disk_usage(_SHARED_MEMORY)
    found = f"{usage.free / 2**20:,.0f} of {usage.total / 2**20:,.0f} MiB free in {_SHARED_MEMORY}"
    if usage.free >= LEAST_SHARED_MEMORY_MIB * 2**20:
        return Finding("shared memory", "ok", found)
    return Finding("shared memory", "warn", found, "Give containers more, for example docker run --shm-size 1g.")


def _numbers(version: str) -> tuple[int, ...]:
    """Return the leading numbers of a version, for example (2, 13, 0) of ``2.13.0+cpu``."""
    match = re.match(r"[0-9]+(\.[0-9]+)*", version)
    return tuple(map(int, match[0].split("."))) if match else ()
