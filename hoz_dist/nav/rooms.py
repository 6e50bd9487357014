"""Room names and the split of rooms into training, validation and test."""

from typing import Final, Literal, NamedTuple

from hoz_dist.errors import InvalidValueError, UnknownNameError
from hoz_dist.nav.categories import ROOM_SCENES, SCENES

Split = Literal["train", "val", "test"]

SPLITS: Final[dict[str, dict[Split, range]]] = {
    **{scene: {"train": range(1, 21), "val": range(21, 26), "test": range(26, 31)} for scene in ROOM_SCENES},
    "apartment": {"train": range(1, 61), "val": range(61, 66), "test": range(66, 76)},
}
"""Room numbers of each split, by scene (AI2-THOR's and RoboTHOR's sizes)."""


class RoomId(NamedTuple):
    """One instance of a scene, written ``kitchen/3``."""

    scene: str
    number: int

    def __str__(self) -> str:
        return f"{self.scene}/{self.number}"

    @property
    def split(self) -> Split:
        """The split that this room belongs to."""
        return next(split for split, numbers in SPLITS[self.scene].items() if self.number in numbers)

    @classmethod
    def parse(cls, text: str) -> "RoomId":
        """Read a room name such as ``kitchen/3``.

        Raises:
            UnknownNameError: There is no such scene or room.
        """
        scene, _, number = text.partition("/")
        if scene not in SCENES:
            raise UnknownNameError.of("scene", scene, SCENES)
        last = SPLITS[scene]["test"].stop - 1
        if not (number.isascii() and number.isdigit() and 1 <= int(number) <= last):
            message = f"Unknown room '{text}': rooms of {scene} are {scene}/1 to {scene}/{last}."
            raise UnknownNameError(message)
        return cls(scene, int(number))


def rooms_of(scene: str, split: Split) -> tuple[RoomId, ...]:
    """Return the rooms of a scene in a split, in ascending number.

    Raises:
        UnknownNameError: There is no such scene.
    """
    if scene not in SCENES:
        raise UnknownNameError.of("scene", scene, SCENES)
    return tuple(RoomId(scene, number) for number in SPLITS[scene][split])


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
            numbers = SPLITS[room.scene]["train"]
            first, last = numbers.start, numbers.stop - 1
            message = f"Room {room} is kept for {kept}; train in {room.scene}/{first} to {room.scene}/{last}."
            raise InvalidValueError(message)
        rooms.add(room)
    return tuple(sorted(rooms, key=lambda room: (SCENES.index(room.scene), room.number)))
