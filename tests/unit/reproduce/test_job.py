from dataclasses import replace
from pathlib import Path

import pytest

from hoz_dist.errors import HozError
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.policy.settings import PRESETS
from hoz_dist.reproduce import job
from hoz_dist.reproduce.budget import BUDGETS
from hoz_dist.reproduce.job import Job, jobs_of, tasks_of
from hoz_dist.reproduce.row import Row
from hoz_dist.reproduce.tables import TABLES
from hoz_dist.sim.view_store import sources_digest
from tests.unit.reproduce.making import TABLE, TINY

OUT = Path("out")
HOZ = TABLE.rows[3]


def one(row: Row, **changes: object) -> Job:
    return jobs_of(TABLE, replace(row, **changes), TINY)[0]  # type: ignore[arg-type]


def test_a_row_has_a_job_for_each_seed() -> None:
    assert [len(jobs_of(TABLE, row, TINY)) for row in TABLE.rows] == [1, 1, 3, 3]
    assert [job.seed for job in jobs_of(TABLE, HOZ, TINY, range(2))] == [0, 1]
    first, second, _ = jobs_of(TABLE, HOZ, TINY)
    assert first.digest == second.digest
    assert first.result(OUT) != second.result(OUT)


def test_rows_of_equal_content_share_training_and_test_whatever_they_are_called() -> None:
    assert one(HOZ, name="another").result(OUT) == one(HOZ).result(OUT)
    assert one(HOZ, options={"zones": 8}).result(OUT) == one(HOZ).result(OUT)


@pytest.mark.parametrize("options", [{"zones": 6}, {"without": ("zone",)}, {"clustering": "random"}])
def test_another_configuration_is_another_run(options: dict[str, object]) -> None:
    other, same = one(HOZ, options=options), one(HOZ)
    assert other.training is not None
    assert same.training is not None
    assert other.training.folder(OUT) != same.training.folder(OUT)
    assert other.result(OUT) != same.result(OUT)


def test_what_is_changed_for_the_test_alone_shares_the_training() -> None:
    other, same = one(TABLE.rows[2]), one(HOZ)
    assert other.training == same.training
    assert other.choice(OUT) == same.choice(OUT)
    assert other.result(OUT) != same.result(OUT)
    assert other.test_config == replace(same.test_config, merge_order=4)


@pytest.mark.parametrize("change", [{"trials": 3}, {"test_episodes": 16}, {"candidates": 2}, {"room_frames": 2000}])
def test_another_protocol_is_another_result(change: dict[str, int]) -> None:
    (other,) = jobs_of(TABLE, TABLE.rows[1], replace(TINY, **change))  # type: ignore[arg-type]
    assert other.result(OUT) != one(TABLE.rows[1]).result(OUT)


def test_more_trials_do_not_train_or_choose_anew() -> None:
    (other,) = jobs_of(TABLE, TABLE.rows[1], replace(TINY, trials=3))
    assert other.training == one(TABLE.rows[1]).training
    assert other.choice(OUT) == one(TABLE.rows[1]).choice(OUT)


def test_another_recipe_or_other_rooms_do_everything_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    before = one(HOZ).digest
    monkeypatch.setattr(job, "RECIPE", job.RECIPE + 1)
    recipe = one(HOZ).digest
    monkeypatch.setattr(job, "recorded_digest", lambda room: f"other {room}")
    assert len({before, recipe, one(HOZ).digest}) == 3


@pytest.mark.parametrize("constant", ["STEP_REWARD", "SUCCESS_REWARD"])
def test_another_reward_trains_anew(monkeypatch: pytest.MonkeyPatch, constant: str) -> None:
    before = one(HOZ)
    folder, result = before.training.folder(OUT) if before.training else OUT, before.result(OUT)
    monkeypatch.setattr(job, constant, 0.5)
    assert before.training is not None
    assert before.training.folder(OUT) != folder
    assert before.result(OUT) != result


def test_other_layer_sizes_train_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    before = one(HOZ).digest
    monkeypatch.setitem(PRESETS, "medium", replace(PRESETS["medium"], lstm=300))
    assert one(HOZ).digest != before


@pytest.mark.parametrize(("constant", "shapes_random"), [("TEMPERATURE", False), ("EPISODE_SEED", True)])
def test_other_evaluations_choose_and_test_anew_but_train_no_more(
    monkeypatch: pytest.MonkeyPatch, constant: str, *, shapes_random: bool
) -> None:
    trained, random = one(HOZ), one(TABLE.rows[0])
    assert trained.training is not None
    before = (trained.training.digest, trained.choice(OUT), trained.result(OUT), random.result(OUT))
    monkeypatch.setattr(job, constant, 7)
    after = (trained.training.digest, trained.choice(OUT), trained.result(OUT), random.result(OUT))
    assert [one != other for one, other in zip(before, after, strict=True)] == [False, True, True, shapes_random]


def test_pictures_and_what_is_derived_from_them_are_those_of_the_recipe() -> None:
    assert (job.RECIPE, sources_digest(load_encoder("pooled"))) == (2, "ec520ba55bb63eab"), (
        "sources that shape pictures have changed: if pictures or detections change, raise RECIPE; "
        "then write the new digest here"
    )


def test_tasks_put_tests_of_one_training_together_and_seeds_first(tmp_path: Path) -> None:
    jobs = [job for row in TABLE.rows for job in jobs_of(TABLE, row, TINY)]
    tasks = tasks_of([*jobs, *(replace(job, row="another") for job in jobs)], tmp_path)
    assert [(task.jobs[0].agent, task.jobs[0].seed, len(task.jobs)) for task in tasks] == [
        ("random", 0, 1),
        ("object", 0, 1),
        ("hoz", 0, 2),
        ("hoz", 1, 2),
        ("hoz", 2, 2),
    ]
    assert [task.name for task in tasks] == [
        "random",
        "object, seed 0",
        "other order, seed 0",
        "other order, seed 1",
        "other order, seed 2",
    ]
    done = tasks[2].jobs[0].result(tmp_path)
    done.parent.mkdir(parents=True)
    done.touch()
    assert tasks[2].waiting(tmp_path) == tasks[2].jobs[1:]
    assert tasks[3].waiting(tmp_path) == tasks[3].jobs


def test_tasks_of_one_method_are_told_apart_by_their_names(tmp_path: Path) -> None:
    table = TABLES["components"]
    tasks = tasks_of([job for row in table.rows for job in jobs_of(table, row, BUDGETS["quick"])], tmp_path)
    names = [task.name for task in tasks]
    assert len(set(names)) == len(names)
    assert "hoz without scene, seed 0" in names


def test_a_row_of_an_unknown_method_is_refused() -> None:
    with pytest.raises(HozError, match="dqn"):
        jobs_of(TABLE, Row(name="dqn", agent="dqn"), TINY)


@pytest.mark.parametrize("table", TABLES)
def test_every_row_of_every_table_can_be_run(table: str) -> None:
    rows = TABLES[table].rows
    assert len({row.name for row in rows}) == len(rows)
    assert set(TABLES[table].references) <= {row.name for row in rows}
    budget = BUDGETS["quick"]
    jobs = [job for row in rows for job in jobs_of(TABLES[table], row, budget)]
    assert len(set(jobs)) == len(jobs)


def test_the_same_agents_of_several_tables_are_one_run() -> None:
    budget = BUDGETS["standard"]
    places = [
        {job.result(OUT) for job in jobs_of(table, next(row for row in table.rows if row.name == "hoz"), budget)}
        for table in TABLES.values()
        if table.name != "apartments"
    ]
    assert all(place == places[0] for place in places)
