"""Checks of the simulator: rendering, and the view cache."""

import os
import re
import shutil
import time
from pathlib import Path
from typing import Final

import numpy as np

from hoz_dist.cli.checks.finding import Finding
from hoz_dist.cli.checks.machine import GIB
from hoz_dist.errors import DamagedFileError, HozError
from hoz_dist.nav.pose import Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.camera import Camera
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.view_folder import ViewFolder
from hoz_dist.sim.view_store import default_cache
from hoz_dist.sim.world import World

SLOW_PICTURE_MS: Final = 20.0
"""A room of 1600 views then takes more than half a minute."""
LEAST_FREE_GIB: Final = 10
"""All 120 rooms take about 8 GiB at the default picture size."""
_PICTURES: Final = 20
_ROOM_FOLDER: Final = re.compile(r"[a-z_]+-[0-9]+-[0-9a-f]{16}")


def check_rendering() -> Finding:
    """Make a room, load it into PyBullet and draw it."""
    try:
        room = load_room(RoomId("kitchen", 1))
    except HozError as error:
        return Finding("rendering", "fail", str(error).rstrip("."))
    with World(room) as world:
        camera = Camera(world)
        start = time.perf_counter()
        frames = [camera.render(Pose(room.width / 2, room.depth / 2, 45 * (n % 8), 0)) for n in range(_PICTURES)]
        milliseconds = (time.perf_counter() - start) / _PICTURES * 1000
    if all(np.ptp(frame.rgb) == 0 for frame in frames):
        return Finding("rendering", "fail", "PyBullet draws blank pictures", "Reinstall it: pip install pybullet.")
    found = f"{milliseconds:.1f} ms a picture"
    if milliseconds <= SLOW_PICTURE_MS:
        return Finding("rendering", "ok", found)
    return Finding("rendering", "warn", found, "Render ahead while nothing else runs: hoz-dist scenes render.")


def check_cache(cache: Path | None) -> Finding:
    """Check that the view cache can be written and that there is room for it."""
    folder = cache or default_cache()
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not (existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)):
        return Finding("cache", "fail", f"{folder} cannot be written", "Set HOZ_CACHE to a folder that can be.")
    size = sum(_disk_bytes(file) for file in folder.rglob("*")) if folder.is_dir() else 0
    free = shutil.disk_usage(existing).free
    found = f"{folder} takes {size / GIB:.2f} GiB, {free / GIB:.1f} GiB are free"
    if free + size >= LEAST_FREE_GIB * GIB:
        return Finding("cache", "ok", found)
    return Finding("cache", "warn", found, f"All rooms take up to {LEAST_FREE_GIB} GiB; set HOZ_CACHE to another disk.")


def check_damage(cache: Path | None) -> Finding:
    """Check that the rooms in the view cache can be opened; pictures are checked whenever they are used."""
    folder = cache or default_cache()
    rooms = sorted(path for path in folder.glob("*") if _ROOM_FOLDER.fullmatch(path.name))
    damaged = [path.name for path in rooms if not _opens(path)]
    if not damaged:
        return Finding("cached rooms", "ok", f"{len(rooms)} rooms, all can be opened (pictures not checked)")
    names = ", ".join(damaged)
    return Finding(
        "cached rooms", "warn", f"{len(damaged)} of {len(rooms)} are damaged: {names}", "They are made again."
    )


def _opens(path: Path) -> bool:
    """Say whether a room's folder can be opened."""
    try:
        ViewFolder.open(path)
    except DamagedFileError:
        return False
    return True


def _disk_bytes(file: Path) -> int:
    """Return what a file takes on the disk: less than its length when pictures are missing; 0 if it just went away."""
    try:
        return file.lstat().st_blocks * 512
    except FileNotFoundError:
        return 0
