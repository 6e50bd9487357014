from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.closeness import near_in, near_pairs
from hoz_dist.sim.room import Item, Part, Room, Vector


def box(category: str, *centre: float) -> Item:
    x, z, height = centre
    place: Vector = (x, z, height)
    return Item(category, (Part("box", (0.2, 0.2, 0.2), place, (0.5, 0.5, 0.5)),))


def room(*items: Item) -> Room:
    return Room(RoomId("kitchen", 1), 8.0, 8.0, items)


def test_the_gap_between_boxes_decides_not_that_of_their_centres() -> None:
    near = room(box("Plate", 1.0, 1.0, 0.9), box("Bowl", 2.1, 1.0, 0.9), box("Sofa", 1.0, 1.0, 0.3))
    far = room(box("Plate", 1.0, 1.0, 0.9), box("Bowl", 2.3, 1.0, 0.9))
    assert near_in(near) == ({("Bowl", "Plate")}, {("Bowl", "Plate")})
    assert near_in(far) == ({("Bowl", "Plate")}, set())


def test_height_counts_and_the_nearest_instances_do() -> None:
    above = room(box("Plate", 1.0, 1.0, 0.1), box("Bowl", 1.0, 1.0, 1.5))
    assert near_in(above)[1] == set()
    several = room(box("Plate", 1.0, 1.0, 0.1), box("Bowl", 7.0, 7.0, 0.1), box("Bowl", 1.5, 1.5, 0.1))
    assert near_in(several)[1] == {("Bowl", "Plate")}


def test_a_pair_counts_when_it_is_near_in_a_third_of_the_rooms_that_hold_both() -> None:
    near = room(box("Plate", 1.0, 1.0, 0.9), box("Bowl", 1.5, 1.0, 0.9))
    far = room(box("Plate", 1.0, 1.0, 0.9), box("Bowl", 5.0, 1.0, 0.9))
    alone = room(box("Plate", 1.0, 1.0, 0.9))
    assert near_pairs([near, far, far, alone, alone]) == [("Bowl", "Plate", 1)]
    assert near_pairs([near, far, far, far]) == []
