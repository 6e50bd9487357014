"""The rooms of the catalogue as data: what they hold, where things stand, and that they are the same everywhere."""

import itertools
import statistics
from collections import Counter

import pytest

from hoz_dist.errors import DamagedFileError, HozError, NotFoundError
from hoz_dist.nav.categories import ROOM_SCENES, SCENE_TARGETS, SCENES, TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim import catalogue
from hoz_dist.sim.catalogue import load_room, targets_of
from hoz_dist.sim.generator import generate_room
from hoz_dist.sim.room import Item, Part, Room
from tests.unit.sim.catalogue_rooms import NUMBERS, rooms

TOUCH = 1e-6


def overlap(a: Part, b: Part, axes: tuple[int, ...] = (0, 1, 2)) -> bool:
    return all(a.low[axis] < b.high[axis] - TOUCH and b.low[axis] < a.high[axis] - TOUCH for axis in axes)


def test_a_room_follows_from_its_name_alone() -> None:
    room = RoomId("kitchen", 3)
    assert generate_room(room, 0) == generate_room(room, 0)
    assert generate_room(room, 0).digest != generate_room(room, 1).digest
    assert len({made.digest for scene in SCENES for made in rooms(scene)}) == sum(map(len, NUMBERS.values()))


@pytest.mark.parametrize("scene", SCENES)
def test_lengths_are_whole_millimetres_and_parts_fit_pybullet(scene: str) -> None:
    for room in rooms(scene):
        for item in room.items:
            assert 1 <= len(item.parts) <= 16
            for part in item.parts:
                assert min(part.size) > 0
                assert all(round(size, 3) == size for size in part.size)
                assert all(round(edge * 2, 3) == edge * 2 for edge in part.centre)
                assert all(0.0 <= channel <= 1.0 for channel in part.colour)
                assert part.shape == "box" or part.size[0] == part.size[1]


@pytest.mark.parametrize("scene", SCENES)
def test_everything_is_between_the_walls(scene: str) -> None:
    for room in rooms(scene):
        for item in room.items:
            if item.category != "Walls":
                assert item.low[0] >= -TOUCH, (room.room, item.category)
                assert item.low[1] >= -TOUCH, (room.room, item.category)
                assert item.low[2] >= -TOUCH, (room.room, item.category)
                assert item.high[0] <= room.width + TOUCH, (room.room, item.category)
                assert item.high[1] <= room.depth + TOUCH, (room.room, item.category)


@pytest.mark.parametrize("scene", SCENES)
def test_no_two_objects_interpenetrate(scene: str) -> None:
    for room in rooms(scene):
        for a, b in itertools.combinations(room.items, 2):
            if all(a.low[axis] < b.high[axis] and b.low[axis] < a.high[axis] for axis in range(3)):
                clash = any(overlap(mine, theirs) for mine in a.parts for theirs in b.parts)
                assert not clash, (room.room, a.category, b.category)


def is_held(item: Item, room: Room) -> bool:
    """Whether an object stands on the floor or another object, or is fixed to a wall."""
    lowest = [part for part in item.parts if part.low[2] <= item.low[2] + TOUCH]
    on_something = any(
        abs(part.high[2] - item.low[2]) < TOUCH and any(overlap(part, mine, (0, 1)) for mine in lowest)
        for other in room.items
        if other is not item
        for part in other.parts
    )
    return on_something or any(
        touch(wall, part)
        for walls in room.items
        if walls.category == "Walls"
        for wall in walls.parts
        for part in item.parts
    )


def touch(wall: Part, part: Part) -> bool:
    """Whether a part's side lies against a wall's."""
    gaps = [max(wall.low[axis] - part.high[axis], part.low[axis] - wall.high[axis]) for axis in range(3)]
    return max(gaps[:2]) == pytest.approx(0.0, abs=TOUCH) and gaps[2] < 0.0


@pytest.mark.parametrize("scene", SCENES)
def test_nothing_floats(scene: str) -> None:
    for room in rooms(scene):
        for item in room.items:
            if item.category == "Sink":  # hangs in a worktop
                tops = [part for other in room.items if other.category == "Counter" for part in other.parts]
                inside = any(abs(part.low[2] - item.low[2]) < 0.2 and overlap_rect(part, item) for part in tops)
                assert inside or item.low[2] < TOUCH
            elif item.category != "Walls":
                assert is_held(item, room), (room.room, item.category, item.low)


def overlap_rect(part: Part, item: Item) -> bool:
    """Whether a part touches an item's box as seen from above."""
    return all(
        part.low[axis] <= item.high[axis] + TOUCH and item.low[axis] <= part.high[axis] + TOUCH for axis in (0, 1)
    )


@pytest.mark.parametrize("scene", SCENES)
def test_rooms_hold_most_of_their_targets(scene: str) -> None:
    always = {"GarbageCan", "Chair" if scene == "apartment" else "LightSwitch"}
    always |= {"Sink"} if scene in {"kitchen", "bathroom"} else set()
    counts: Counter[str] = Counter()
    for room in rooms(scene):
        held = {TARGETS[index] for index in targets_of(room)}
        assert always <= held <= set(SCENE_TARGETS[scene])
        assert len(held) >= 0.7 * len(SCENE_TARGETS[scene])
        counts.update(held)
    for target in SCENE_TARGETS[scene]:
        assert counts[target] >= 0.6 * len(NUMBERS[scene]), target


def test_a_kitchen_has_a_stove_with_four_burners() -> None:
    for room in rooms("kitchen"):
        (stove,) = (item for item in room.items if item.category == "Stove")
        burners = [item for item in room.items if item.category == "StoveBurner"]
        assert len(burners) == 4
        for burner in burners:
            assert any(overlap(part, below, (0, 1)) for part in burner.parts for below in stove.parts)


def receptacles(scene: str, category: str) -> Counter[str]:
    """Count what the objects of a category stand on."""
    found: Counter[str] = Counter()
    for room in rooms(scene):
        for item in room.items:
            if item.category == category:
                foot = min(item.parts, key=lambda part: part.low[2])
                found.update(
                    {
                        other.category
                        for other in room.items
                        for part in other.parts
                        if other is not item and abs(part.high[2] - foot.low[2]) < TOUCH and overlap(part, foot, (0, 1))
                    }
                )
    return found


@pytest.mark.parametrize(
    ("scene", "category", "usual"),
    [
        ("kitchen", "Microwave", "Counter"),
        ("kitchen", "Toaster", "Counter"),
        ("kitchen", "CoffeeMachine", "Counter"),
        ("kitchen", "Kettle", "Counter"),
        ("kitchen", "Plate", "DiningTable"),
        ("living_room", "RemoteControl", "CoffeeTable"),
        ("living_room", "DeskLamp", "SideTable"),
        ("bedroom", "AlarmClock", "SideTable"),
        ("bedroom", "Laptop", "Desk"),
        ("apartment", "AlarmClock", "SideTable"),
        ("apartment", "Pot", "StoveBurner"),
    ],
)
def test_things_are_mostly_where_they_are_used(scene: str, category: str, usual: str) -> None:
    places = receptacles(scene, category)
    assert places.most_common(1)[0][0] == usual
    assert len(places) > 1, "homes vary"


@pytest.mark.parametrize(
    ("category", "size"),
    [
        ("AlarmClock", (0.19, 0.09, 0.18)),
        ("Book", (0.22, 0.27, 0.03)),
        ("Bowl", (0.20, 0.20, 0.09)),
        ("CellPhone", (0.08, 0.15, 0.01)),
        ("Chair", (0.48, 0.54, 0.88)),
        ("CoffeeMachine", (0.44, 0.44, 0.44)),
        ("DeskLamp", (0.26, 0.29, 0.46)),
        ("FloorLamp", (0.52, 0.51, 1.87)),
        ("Fridge", (1.0, 0.72, 1.84)),
        ("GarbageCan", (0.45, 0.37, 0.56)),
        ("Kettle", (0.20, 0.21, 0.19)),
        ("Laptop", (0.40, 0.30, 0.29)),
        ("LightSwitch", (0.13, 0.03, 0.15)),
        ("Microwave", (0.61, 0.36, 0.35)),
        ("Pan", (0.28, 0.43, 0.05)),
        ("Plate", (0.24, 0.24, 0.02)),
        ("Pot", (0.29, 0.31, 0.16)),
        ("RemoteControl", (0.06, 0.21, 0.02)),
        ("StoveBurner", (0.2, 0.2, 0.02)),
        ("Television", (1.14, 0.31, 0.81)),
        ("Toaster", (0.22, 0.36, 0.21)),
    ],
)
def test_median_sizes_follow_the_field(category: str, size: tuple[float, float, float]) -> None:
    items = [item for scene in ROOM_SCENES for room in rooms(scene) for item in room.items if item.category == category]
    measured = [sorted(item.high[axis] - item.low[axis] for axis in (0, 1)) for item in items]
    heights = [item.high[2] - item.low[2] for item in items]
    expected = sorted(size[:2])
    for axis in (0, 1):
        # Large objects within 30%; thin ones, such as a phone, within 3 cm.
        assert statistics.median(m[axis] for m in measured) == pytest.approx(expected[axis], rel=0.3, abs=0.03)
    assert statistics.median(heights) == pytest.approx(size[2], rel=0.3, abs=0.03)
    assert len({round(small, 3) for small, _ in measured} | {round(large, 3) for _, large in measured}) > 2, (
        "sizes vary"
    )


def test_where_chairs_occur_there_are_about_two_and_a_half() -> None:
    counts = [sum(item.category == "Chair" for item in room.items) for scene in ROOM_SCENES for room in rooms(scene)]
    assert 1.9 <= statistics.mean(count for count in counts if count) <= 3.1


def test_the_sofa_looks_at_the_television() -> None:
    for room in rooms("living_room"):
        sofas = [item for item in room.items if item.category == "Sofa"]
        for television in (item for item in room.items if item.category == "Television"):
            across = [
                axis
                for sofa in sofas
                for axis in (0, 1)
                if sofa.low[axis] < (television.low[axis] + television.high[axis]) / 2 < sofa.high[axis]
            ]
            assert across, room.room


def test_a_room_that_comes_out_differently_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "generate_room", lambda room, attempt: generate_room(room, attempt + 1))
    with pytest.raises(HozError, match="kitchen/1 comes out differently"):
        load_room(RoomId("kitchen", 1))


def test_an_unknown_room_and_a_damaged_catalogue_are_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with pytest.raises(NotFoundError, match="kitchen/99"):
        load_room(RoomId("kitchen", 99))
    damaged = tmp_path_factory.mktemp("catalogue") / "catalogue.json"
    damaged.write_text("[1, 2")
    monkeypatch.setattr(catalogue, "CATALOGUE_PATH", damaged)
    catalogue._read_catalogue.cache_clear()
    try:
        with pytest.raises(DamagedFileError, match="catalogue of rooms"):
            load_room(RoomId("kitchen", 1))
    finally:
        catalogue._read_catalogue.cache_clear()
