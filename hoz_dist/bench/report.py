"""What a benchmark found, and on which machine."""

import importlib.metadata
import os
import platform
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

_CPU_FILE: Final = Path("/proc/cpuinfo")
_PACKAGES: Final = {"torch": "torch", "numpy": "numpy", "zenoh": "eclipse-zenoh", "pybullet": "pybullet"}
"""Packages whose version matters for the speed, by the name that reports give them."""
Machine = Mapping[str, str | int | float]


@dataclass(frozen=True)
class Metric:
    """One figure: of several measurements the median, the least and the largest."""

    median: float
    min: float
    max: float
    unit: str
    limit: float | None
    """What the machine allows, in the same unit, measured in the same run; None where there is no such thing."""

    @classmethod
    def of(cls, samples: Sequence[float], unit: str, limit: Sequence[float] | float | None = None) -> Self:
        """Sum up measurements.

        Args:
            samples: The measurements, at least one.
            unit: Their unit.
            limit: The limit, or measurements of it, whose median counts.
        """
        if isinstance(limit, Sequence):
            limit = statistics.median(limit)
        return cls(statistics.median(samples), min(samples), max(samples), unit, limit)


@dataclass(frozen=True)
class Report:
    """What one run of a benchmark found."""

    metrics: Mapping[str, Metric]
    """By name."""
    machine: Machine
    command: str
    """The command that finds it again."""

    def to_json(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        return {
            "metrics": {name: asdict(metric) for name, metric in self.metrics.items()},
            "machine": dict(self.machine),
            "command": self.command,
        }


def this_machine() -> Machine:
    """Describe this machine as far as speed depends on it; neither its name nor any path."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    versions = {name: importlib.metadata.version(package) for name, package in _PACKAGES.items()}
    return {
        "cpu": _cpu(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(memory / 2**30, 1),
        "kernel": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        **versions,
    }


def _cpu() -> str:
    """Return the model of the processor, as far as the system says."""
    lines = _CPU_FILE.read_text(encoding="utf-8").splitlines() if _CPU_FILE.exists() else []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.machine())
