import pytest

from hoz_dist.errors import HozError, InvalidValueError, UnknownNameError
from hoz_dist.nav.categories import ROOM_SCENES, SCENES
from hoz_dist.nav.rooms import SPLITS, RoomId, rooms_of, training_rooms


@pytest.mark.parametrize("scene", SCENES)
def test_splits_share_no_room_and_cover_all(scene: str) -> None:
    numbers = [number for split in SPLITS[scene].values() for number in split]
    sizes = [60, 5, 10] if scene == "apartment" else [20, 5, 5]
    assert numbers == list(range(1, sum(sizes) + 1))
    assert [len(SPLITS[scene][split]) for split in ("train", "val", "test")] == sizes


@pytest.mark.parametrize(
    ("name", "split"),
    [
        ("kitchen/1", "train"),
        ("kitchen/20", "train"),
        ("bathroom/21", "val"),
        ("bedroom/25", "val"),
        ("living_room/26", "test"),
        ("living_room/30", "test"),
        ("apartment/60", "train"),
        ("apartment/61", "val"),
        ("apartment/75", "test"),
    ],
)
def test_room_names_read_back_and_know_their_split(name: str, split: str) -> None:
    room = RoomId.parse(name)
    assert str(room) == name
    assert room.split == split


@pytest.mark.parametrize(
    "name",
    [
        "garage/1",
        "kitchen",
        "kitchen/",
        "kitchen/0",
        "kitchen/31",
        "apartment/76",
        "kitchen/-1",
        "kitchen/x",
        "kitchen/1/2",
        "kitchen/²",
        "",
    ],
)
def test_names_of_no_room_are_refused_in_one_sentence(name: str) -> None:
    with pytest.raises(UnknownNameError) as caught:
        RoomId.parse(name)
    assert "\n" not in str(caught.value)


def test_rooms_of_a_split_come_in_ascending_number() -> None:
    assert [str(room) for room in rooms_of("bathroom", "val")] == [f"bathroom/{n}" for n in range(21, 26)]
    with pytest.raises(UnknownNameError):
        rooms_of("garage", "train")


def test_a_scene_means_all_its_training_rooms() -> None:
    assert training_rooms(("kitchen",)) == rooms_of("kitchen", "train")


def test_training_rooms_are_ordered_and_each_comes_once() -> None:
    rooms = training_rooms(("bathroom/3", "kitchen/2", "kitchen/10", "bathroom/3"))
    assert [str(room) for room in rooms] == ["kitchen/2", "kitchen/10", "bathroom/3"]
    assert len(training_rooms(("kitchen", "kitchen/3"))) == 20
    assert len(training_rooms(ROOM_SCENES)) == 80
    assert len(training_rooms(SCENES)) == 140


@pytest.mark.parametrize(
    ("room", "kept"), [("kitchen/25", "validation"), ("bedroom/26", "test"), ("apartment/61", "validation")]
)
def test_training_refuses_rooms_kept_for_validation_and_test(room: str, kept: str) -> None:
    with pytest.raises(InvalidValueError, match=f"{room} is kept for {kept}"):
        training_rooms(("kitchen/1", room))


def test_training_refuses_unknown_names() -> None:
    for name in ("garage", "kitchen/99"):
        with pytest.raises(HozError):
            training_rooms((name,))
