"""Room names and the split of rooms into training, validation and test."""

from typing import Final, Literal, NamedTuple

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.nav.categories import SCENES

Split = Literal["train", "val", "test"]

SPLITS: Final[dict[Split, range]] = {"train": range(1, 21), "val": range(21, 26), "test": range(26, 31)}
"""Room numbers of each split, the same for every scene."""


class RoomId(NamedTuple):
    """One instance of a scene, written ``kitchen/3``."""

    scene: str
    number: int

    def __str__(self) -> str:
        return f"{self.scene}/{self.number}"

    @property
    def split(self) -> Split:
        """The split that this room belongs to."""
        return next(split for split, numbers in SPLITS.items() if self.number in numbers)

    @classmethod
    def parse(cls, text: str) -> "RoomId":
        """Read a room name such as ``kitchen/3``.

        Raises:
            UnknownNameError: There is no such scene or room.
        """
        scene, _, number = text.partition("/")
        if scene not in SCENES:
            raise UnknownNameError.of("scene", scene, SCENES)
        if not (number.isascii() and number.isdigit() and 1 <= int(number) <= SPLITS["test"].stop - 1):
            message = f"Unknown room '{text}': rooms of {scene} are {scene}/1 to {scene}/{SPLITS['test'].stop - 1}."
            raise UnknownNameError(message)
        return cls(scene, int(number))


def rooms_of(scene: str, split: Split) -> tuple[RoomId, ...]:
    """Return the rooms of a scene in a split, in ascending number.

    Raises:
        UnknownNameError: There is no such scene.
    """
    if scene not in SCENES:
        raise UnknownNameError.of("scene", scene, SCENES)
    return tuple(RoomId(scene, number) for number in SPLITS[split])


def training_rooms(names: tuple[str, ...]) -> tuple[RoomId, ...]:
    """Resolve what an actor was told to train in.

    Args:
        names: Scenes (``kitchen``: all its training rooms) and rooms (``kitchen/3``), in any order.

    Returns:
        The rooms, each once, ordered by scene and number.

    Raises:
        UnknownNameError: A name is not a scene or a room.
        InvalidValueError: A room is kept for validation or test.
    """
    rooms: set[RoomId] = set()
    for name in names:
        if "/" not in name:
            rooms.update(rooms_of(name, "train"))
            continue
        room = RoomId.parse(name)
        if room.split != "train":
            kept = "validation" if room.split == "val" else "test"
            first, last = SPLITS["train"].start, SPLITS["train"].stop - 1
            message = f"Room {room} is kept for {kept}; train in {room.scene}/{first} to {room.scene}/{last}."
            raise InvalidValueError(message)
        rooms.add(room)
    return tuple(sorted(rooms, key=lambda room: (SCENES.index(room.scene), room.number)))
