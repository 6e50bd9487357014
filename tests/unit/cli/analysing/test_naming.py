from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hoz_dist.cli.analysing.naming import method_names
from hoz_dist.config import RunConfig

HOZ, OBJECT = RunConfig(method="hoz"), RunConfig(method="object")


def names(*configs: RunConfig) -> list[str]:
    return method_names([Path("runs") / f"r{number}" for number in range(len(configs))], configs)


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
