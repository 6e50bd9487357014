from pathlib import Path

import pytest

from hoz_dist.reproduce.costs import SHARE_COMPUTED, START_S, STEP_S, Costs, Speed, makespan
from hoz_dist.reproduce.job import jobs_of, tasks_of
from tests.unit.reproduce.making import TABLE, TINY

JOBS = jobs_of(TABLE, TABLE.rows[3], TINY, range(1)) + jobs_of(TABLE, TABLE.rows[2], TINY, range(1))


@pytest.fixture
def costs() -> Costs:
    assert JOBS[0].training is not None
    return Costs({JOBS[0].training.digest: Speed(100.0, 0.001)})


def test_a_task_is_its_training_its_choice_and_its_tests(costs: Costs, tmp_path: Path) -> None:
    (task,) = tasks_of(JOBS, tmp_path)
    train = START_S + 1000 / 100
    # Bathrooms end after 100 actions; every step costs 1 ms for each episode.
    choose, test = (number * 100 * SHARE_COMPUTED * 0.001 for number in (3 * 600, 2 * 8))
    assert costs.of_task(task, task.jobs) == pytest.approx(train + choose + 2 * test)
    assert costs.of_task(task, task.jobs[1:], done=1000) == pytest.approx(choose + test)
    assert costs.of_task(task, task.jobs[1:], done=1000, chosen=True) == pytest.approx(test)
    assert costs.of_task(task, ()) == 0.0


def test_agents_that_are_not_trained_cost_their_test(costs: Costs, tmp_path: Path) -> None:
    (task,) = tasks_of(jobs_of(TABLE, TABLE.rows[0], TINY), tmp_path)
    assert costs.of_task(task, task.jobs) == pytest.approx(2 * 8 * 100 * SHARE_COMPUTED * STEP_S)


@pytest.mark.parametrize(
    ("seconds", "processes", "expected"),
    [([3.0, 2.0, 2.0], 1, 7.0), ([3.0, 2.0, 2.0], 2, 4.0), ([3.0, 2.0, 2.0], 9, 3.0), ([], 2, 0.0)],
)
def test_processes_take_the_next_task_when_they_are_free(seconds: list[float], processes: int, expected: float) -> None:
    assert makespan(seconds, processes) == expected
