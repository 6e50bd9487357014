import hashlib

import pytest

from hoz_dist.errors import UnknownNameError
from hoz_dist.nav.categories import (
    ROOM_SCENES,
    SCENE_TARGETS,
    SCENES,
    TARGETS,
    category_index,
    scene_index,
    scenes_to_tell,
)


def test_targets_keep_the_order_of_the_released_graphs() -> None:
    assert len(TARGETS) == len(set(TARGETS)) == 22
    assert list(TARGETS) == sorted(TARGETS)
    # The columns of released .mat files have no names: a changed order would read them wrongly, without a sign.
    assert hashlib.sha256(",".join(TARGETS).encode()).hexdigest()[:16] == "83cf2e388d60e4e2"


def test_scenes_and_their_targets_are_the_released_protocols() -> None:
    assert ROOM_SCENES == ("kitchen", "living_room", "bedroom", "bathroom")
    # Saved scene layers and messages number the scenes: new ones come last.
    assert SCENES[-1] == "apartment"
    assert SCENES[:-1] == ROOM_SCENES
    assert [len(SCENE_TARGETS[scene]) for scene in SCENES] == [14, 10, 8, 3, 12]


@pytest.mark.parametrize("scene", SCENES)
def test_every_target_of_a_scene_is_a_category(scene: str) -> None:
    targets = SCENE_TARGETS[scene]
    assert set(targets) <= set(TARGETS)
    assert len(targets) == len(set(targets))


def test_category_index_finds_every_category_in_any_case() -> None:
    assert [category_index(name) for name in TARGETS] == list(range(22))
    assert category_index("microwave") == category_index("MICROWAVE") == TARGETS.index("Microwave")


def test_unknown_category_names_the_nearest_and_all_known() -> None:
    with pytest.raises(
        UnknownNameError, match=r"Unknown target 'Microwav'\. Did you mean 'Microwave'\? Known: AlarmClock"
    ):
        category_index("Microwav")


def test_scene_index_is_the_place_in_the_order() -> None:
    assert [scene_index(scene) for scene in SCENES] == [0, 1, 2, 3, 4]


def test_a_scene_layer_needs_an_output_for_apartments_in_apartments_only() -> None:
    assert scenes_to_tell(["kitchen"]) == scenes_to_tell(ROOM_SCENES) == 4
    assert scenes_to_tell(["apartment"]) == scenes_to_tell(SCENES) == 5


def test_unknown_scene_is_refused_with_the_known_ones() -> None:
    with pytest.raises(
        UnknownNameError, match=r"Unknown scene 'garage'\. Known: kitchen, living_room, bedroom, bathroom"
    ):
        scene_index("garage")
