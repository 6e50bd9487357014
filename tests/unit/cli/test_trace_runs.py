from dataclasses import replace
from pathlib import Path

from hoz_dist.cli.trace_runs import method_names
from hoz_dist.config import RunConfig

HOZ, OBJECT = RunConfig(method="hoz"), RunConfig(method="object")


def names(*configs: RunConfig) -> list[str]:
    return method_names([Path("runs") / f"r{number}" for number in range(len(configs))], configs)


def test_runs_that_differ_by_their_seed_are_one_method() -> None:
    assert names(HOZ, OBJECT, replace(HOZ, seed=3)) == ["hoz", "object", "hoz"]


def test_layers_that_are_switched_off_belong_to_the_name() -> None:
    assert names(HOZ, replace(HOZ, without=("done",))) == ["hoz", "hoz-no-done"]


def test_other_differences_show_as_paths() -> None:
    other = replace(HOZ, zones=16)
    assert names(HOZ, other, replace(other, seed=1), OBJECT) == [
        "hoz (runs/r0)",
        "hoz (runs/r1)",
        "hoz (runs/r1)",
        "object",
    ]


def test_two_checkpoints_of_one_run_are_no_two_seeds() -> None:
    assert names(HOZ, HOZ) == ["hoz (runs/r0)", "hoz (runs/r1)"]
