"""Object categories and the targets of each scene."""

from collections.abc import Iterable
from typing import Final

from hoz_dist.errors import UnknownNameError

TARGETS: Final[tuple[str, ...]] = (
    "AlarmClock",
    "Book",
    "Bowl",
    "CellPhone",
    "Chair",
    "CoffeeMachine",
    "DeskLamp",
    "FloorLamp",
    "Fridge",
    "GarbageCan",
    "Kettle",
    "Laptop",
    "LightSwitch",
    "Microwave",
    "Pan",
    "Plate",
    "Pot",
    "RemoteControl",
    "Sink",
    "StoveBurner",
    "Television",
    "Toaster",
)
"""The 22 target categories, in the order of the released HOZ graphs; N = 22."""

SCENE_TARGETS: Final[dict[str, tuple[str, ...]]] = {
    "kitchen": (
        "Fridge",
        "LightSwitch",
        "Pot",
        "CoffeeMachine",
        "Sink",
        "Pan",
        "Chair",
        "Plate",
        "Bowl",
        "Toaster",
        "StoveBurner",
        "Kettle",
        "Microwave",
        "GarbageCan",
    ),
    "living_room": (
        "FloorLamp",
        "Chair",
        "Plate",
        "LightSwitch",
        "GarbageCan",
        "Laptop",
        "RemoteControl",
        "Book",
        "Television",
        "DeskLamp",
    ),
    "bedroom": ("Book", "LightSwitch", "Bowl", "DeskLamp", "Laptop", "Chair", "AlarmClock", "GarbageCan"),
    "bathroom": ("LightSwitch", "GarbageCan", "Sink"),
    "apartment": (
        "Book",
        "Bowl",
        "Chair",
        "Plate",
        "Television",
        "FloorLamp",
        "GarbageCan",
        "AlarmClock",
        "DeskLamp",
        "Laptop",
        "Pot",
        "CellPhone",
    ),
}
"""The categories that an agent may be sent to find, per scene (released protocols of AI2-THOR and RoboTHOR)."""

SCENES: Final[tuple[str, ...]] = tuple(SCENE_TARGETS)
"""The scenes, in the order of the scene layer's outputs; S = 5."""
ROOM_SCENES: Final[tuple[str, ...]] = SCENES[:4]
"""The scenes of single rooms: what is trained in unless somebody asks for apartments."""


def category_index(name: str) -> int:
    """Return the index of a category in `TARGETS`.

    Args:
        name: A category, for example ``"Microwave"``; upper and lower case are the same.

    Raises:
        UnknownNameError: There is no such category.
    """
    for index, known in enumerate(TARGETS):
        if known.lower() == name.lower():
            return index
    raise UnknownNameError.of("target", name, TARGETS)


def scenes_to_tell(scenes: Iterable[str]) -> int:
    """Return how many outputs a scene layer needs in some scenes: one for each scene of rooms, or for all scenes."""
    return len(ROOM_SCENES) if set(scenes) <= set(ROOM_SCENES) else len(SCENES)


def scene_index(name: str) -> int:
    """Return the index of a scene in `SCENES`.

    Raises:
        UnknownNameError: There is no such scene.
    """
    if name not in SCENES:
        raise UnknownNameError.of("scene", name, SCENES)
    return SCENES.index(name)
