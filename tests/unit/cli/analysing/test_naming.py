from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.analysing.naming import Training, method_names
from hoz_dist.config import RunConfig

HOZ, OBJECT = RunConfig(method="hoz"), RunConfig(method="object")


FRAMES = 3_000_000
ROOMS = frozenset({("bathroom/1", "d1"), ("kitchen/1", "d2")})


def trained(config: RunConfig, frames: int = FRAMES, rooms: frozenset[tuple[str, str]] = ROOMS) -> Training:
    return Training(config, frames, rooms)


def names_of(*trainings: Training) -> list[str]:
    return method_names([Path("runs") / f"r{number}" for number in range(len(trainings))], trainings)


def names(*configs: RunConfig) -> list[str]:
    return names_of(*map(trained, configs))


def seed(number: int) -> RunConfig:
    return replace(HOZ, seed=number)


def test_runs_that_differ_by_their_seed_are_one_method() -> None:
    assert names(HOZ, OBJECT, replace(HOZ, seed=3)) == ["hoz", "object", "hoz"]


def test_layers_that_are_switched_off_belong_to_the_name() -> None:
    assert names(HOZ, replace(HOZ, without=("done",))) == ["hoz", "hoz-no-done"]


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"subgoal": "random"}, "hoz-subgoal-random"),
        (
            {"clustering": "spectral", "graph_source": "random-edges"},
            "hoz-clustering-spectral-graph-source-random-edges",
        ),
        ({"merge_order": 0, "without": ("scene", "done")}, "hoz-no-scene-no-done-merge-order-0"),
    ],
)
def test_a_run_with_another_guide_is_never_called_by_its_plain_method(options: dict[str, Any], name: str) -> None:
    assert names(replace(HOZ, **options)) == [name]


def test_other_options_are_named_where_runs_would_share_a_name() -> None:
    more = replace(HOZ, zones=16, discount=0.99)
    assert names(more, OBJECT, replace(more, seed=1)) == ["hoz", "object", "hoz"]
    assert names(HOZ, more, replace(more, seed=1), OBJECT) == [
        "hoz",
        "hoz-zones-16-discount-0.99",
        "hoz-zones-16-discount-0.99",
        "object",
    ]


def test_differences_that_fit_no_name_show_as_paths() -> None:
    scene_priors = RunConfig(method="sp")
    assert names(scene_priors, replace(scene_priors, relations=("Bowl+Plate",)), OBJECT) == [
        "sp (runs/r0)",
        "sp (runs/r1)",
        "object",
    ]


def test_two_checkpoints_of_one_run_are_no_two_seeds() -> None:
    assert names(HOZ, HOZ) == ["hoz (runs/r0)", "hoz (runs/r1)"]


def test_seeds_of_one_budget_are_one_method_though_they_end_within_an_update() -> None:
    update = HOZ.batch * HOZ.rollout_steps
    ends = (FRAMES + 17, FRAMES + update - 1, FRAMES)
    assert names_of(*(trained(seed(number), end) for number, end in enumerate(ends))) == ["hoz"] * 3
    # Of a short budget an update is a large share.
    assert names_of(trained(seed(0), 6000), trained(seed(1), 6000 + update - 1)) == ["hoz", "hoz"]


def test_runs_of_other_frames_are_no_seeds_of_one_method() -> None:
    runs = [(0, FRAMES), (0, 1_000_000), (1, FRAMES + 100), (1, 1_000_100), (2, 1_030_000)]
    assert names_of(*(trained(seed(number), frames) for number, frames in runs), trained(OBJECT, 5)) == [
        "hoz (3,000,000 frames)",
        "hoz (1,000,000 frames)",
        "hoz (3,000,000 frames)",
        "hoz (1,000,000 frames)",
        "hoz (1,030,000 frames)",
        "object",
    ]


def test_runs_that_were_trained_in_other_rooms_are_no_seeds_of_one_method() -> None:
    fewer = frozenset({("bathroom/1", "d1")})
    both = [trained(seed(0)), trained(seed(1), rooms=fewer), trained(seed(2))]
    assert names_of(*both) == ["hoz (2 rooms)", "hoz (1 room)", "hoz (2 rooms)"]
    assert names_of(both[0], both[1]._replace(frames=5_000_000)) == [
        "hoz (2 rooms, 3,000,000 frames)",
        "hoz (1 room, 5,000,000 frames)",
    ]


@pytest.mark.parametrize("other", [("bathroom/2", "d3"), ("bathroom/1", "of another catalogue")])
def test_as_many_other_rooms_show_as_paths(other: tuple[str, str]) -> None:
    rooms = frozenset({other, ("kitchen/1", "d2")})
    assert names_of(trained(seed(0)), trained(seed(1), rooms=rooms)) == ["hoz (runs/r0)", "hoz (runs/r1)"]
