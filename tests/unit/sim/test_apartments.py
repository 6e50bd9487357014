"""Layouts of apartments, and that what is seen near tells what is far."""

import itertools
from collections import Counter
from random import Random

import pytest

from hoz_dist.sim.generator.apartment_layout import KINDS, THICK, Layout, draw_layout
from hoz_dist.sim.generator.solids import Rect
from hoz_dist.sim.room import Item
from tests.unit.sim.catalogue_rooms import rooms

KINDS_OF_ROOMS = (("living", "kitchen", "bedroom", "study"), ("living", "kitchen", "bedroom", "bath"))
AGENT_WIDTH = 400


@pytest.fixture(params=range(12))
def layout(request: pytest.FixtureRequest) -> Layout:
    return draw_layout(Random(request.param), KINDS_OF_ROOMS[request.param % 2])


def shared(one: Rect, other: Rect) -> Rect:
    return Rect(max(one.x0, other.x0), max(one.z0, other.z0), min(one.x1, other.x1), min(one.z1, other.z1))


def test_rooms_fill_the_apartment_and_have_walls_between_them(layout: Layout) -> None:
    outline = Rect(-THICK, -THICK, layout.width + THICK, layout.depth + THICK)
    with_walls = [cell.inside.grown(THICK) for cell in layout.cells]
    assert all(outline.holds(rect) for rect in with_walls)
    assert not any(one.overlaps(other) for one, other in itertools.combinations(with_walls, 2))
    area = (outline.x1 - outline.x0) * (outline.z1 - outline.z0)
    assert sum((rect.x1 - rect.x0) * (rect.z1 - rect.z0) for rect in with_walls) == area
    for cell in layout.cells:
        assert min(cell.inside.x1 - cell.inside.x0, cell.inside.z1 - cell.inside.z0) >= KINDS[cell.kind].least


def test_doorways_connect_all_rooms_and_are_wide_enough(layout: Layout) -> None:
    reached = {0}
    for _ in layout.cells:
        reached |= {number for doorway in layout.doorways if reached & set(doorway.cells) for number in doorway.cells}
    assert reached == set(range(len(layout.cells)))
    for doorway in layout.doorways:
        sides = sorted((doorway.hole.x1 - doorway.hole.x0, doorway.hole.z1 - doorway.hole.z0))
        assert sides[0] == 2 * THICK
        assert sides[1] >= 2 * AGENT_WIDTH
        for number in doorway.cells:
            inside = layout.cells[number].inside
            assert not inside.overlaps(doorway.hole)
            touching = shared(inside, doorway.hole)
            assert sorted((touching.x1 - touching.x0, touching.z1 - touching.z0)) == [0, sides[1]]


def test_bathrooms_have_one_door(layout: Layout) -> None:
    for number, cell in enumerate(layout.cells):
        assert cell.kind != "bath" or sum(number in doorway.cells for doorway in layout.doorways) == 1


def contains(walls: Item, item: Item) -> bool:
    """Whether the middle of an object is in the room that some walls are around."""
    middle = [(low + high) / 2 for low, high in zip(item.low, item.high, strict=True)]
    return all(walls.low[axis] < middle[axis] < walls.high[axis] for axis in (0, 1))


def beside(category: str) -> tuple[int, Counter[str]]:
    """Count the objects of a category, and in the rooms of how many of them others are."""
    objects, found = 0, Counter[str]()
    for room in rooms("apartment"):
        for item in room.items:
            if item.category == category:
                (walls,) = (walls for walls in room.items if walls.category == "Walls" and contains(walls, item))
                objects += 1
                found.update({other.category for other in room.items if contains(walls, other)})
    return objects, found


@pytest.mark.parametrize(
    ("category", "landmark", "share"),
    [
        ("Pot", "Fridge", 1.0),
        ("AlarmClock", "Bed", 0.8),
        ("Television", "Sofa", 0.7),
        ("Plate", "DiningTable", 0.6),
    ],
)
def test_things_are_in_the_rooms_where_they_are_used(category: str, landmark: str, share: float) -> None:
    objects, found = beside(category)
    assert objects >= 15
    assert found[landmark] >= share * objects


def test_apartments_have_three_or_four_rooms_and_about_two_and_a_half_times_the_area_of_a_room() -> None:
    counts = Counter(sum(item.category == "Walls" for item in room.items) for room in rooms("apartment"))
    assert set(counts) == {3, 4}
    # The mean of our 120 rooms is 19.7 m2.
    areas = [room.width * room.depth for room in rooms("apartment")]
    assert sum(areas) / len(areas) == pytest.approx(2.4 * 19.7, rel=0.1)
