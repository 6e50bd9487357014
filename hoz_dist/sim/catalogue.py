"""The rooms that exist: for each name the attempt of the generator that was accepted, and what it must give."""

import json
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.errors import DamagedFileError, HozError, NotFoundError
from hoz_dist.nav.categories import SCENE_TARGETS, category_index
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.generator import generate_room
from hoz_dist.sim.room import Room

CATALOGUE_PATH: Final = Path(__file__).with_name("catalogue.json")
"""Made by `hoz_dist.sim.validation`."""


class RoomDiffersError(HozError):
    """This machine generates another room than the catalogue records."""


class Entry(NamedTuple):
    """What the catalogue records of a room."""

    attempt: int
    """The first attempt of the generator that passed validation."""
    digest: str
    """`Room.digest` of that attempt."""


def load_room(room: RoomId) -> Room:
    """Make a room of the catalogue.

    Raises:
        NotFoundError: The catalogue does not have the room.
        RoomDiffersError: What is generated here is not what was validated.
    """
    entry = _entry(room)
    made = generate_room(room, entry.attempt)
    if made.digest != entry.digest:
        message = (
            f"Room {room} comes out differently on this machine than in the catalogue (digest {made.digest}, not "
            f"{entry.digest}), so results would not compare; reinstall hoz-dist."
        )
        raise RoomDiffersError(message)
    return made


def recorded_digest(room: RoomId) -> str:
    """Return the digest of a room of the catalogue without making the room, which takes tens of milliseconds.

    Raises:
        NotFoundError: The catalogue does not have the room.
    """
    return _entry(room).digest


def targets_of(room: Room) -> tuple[int, ...]:
    """Return the category indices of those targets of the room's scene that it holds, in the scene's order."""
    held = {item.category for item in room.items}
    return tuple(category_index(name) for name in SCENE_TARGETS[room.room.scene] if name in held)


def _entry(room: RoomId) -> Entry:
    entry = _read_catalogue().get(str(room))
    if entry is None:
        message = f"Room {room} is not in the catalogue of rooms; use one that `hoz-dist scenes list` names."
        raise NotFoundError(message)
    return entry


@cache
def _read_catalogue() -> dict[str, Entry]:
    """Read the catalogue once per process."""
    try:
        content = json.loads(CATALOGUE_PATH.read_text(encoding="utf-8"))
        return {name: Entry(attempt=entry["attempt"], digest=entry["digest"]) for name, entry in content.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        message = "The catalogue of rooms cannot be read; reinstall hoz-dist."
        raise DamagedFileError(message) from error
