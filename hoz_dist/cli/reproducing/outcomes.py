"""The outcomes that a folder holds of a table's jobs, checked to be theirs: a file may be copied, cut off or edited."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hoz_dist.errors import DamagedFileError, InvalidValueError
from hoz_dist.reproduce.job import Job, Task
from hoz_dist.reproduce.outcome import Outcome


def read_outcomes(jobs: Mapping[str, Sequence[Job]], out: Path) -> dict[str, dict[int, Outcome]]:
    """Read what is finished.

    Args:
        jobs: Of each row.
        out: Folder of everything.

    Returns:
        Outcomes by row and seed.

    Raises:
        DamagedFileError: A file holds no outcome, or that of another job.
        InvalidValueError: Two outcomes of what should be the same agent are of different ones.
    """
    outcomes = {
        name: {job.seed: _outcome_of(job, out) for job in of_row if job.result(out).exists()}
        for name, of_row in jobs.items()
    }
    _refuse_two_trainings([job for of_row in jobs.values() for job in of_row], outcomes, out)
    return outcomes


def refuse_lost_runs(tasks: Iterable[Task], out: Path) -> None:
    """Refuse to train agents anew of which results are kept, when they would be compared as if they were the same.

    The same seed gives the same agent on the same processor only, and only if nothing kills it. What was tested is kept
    when the runs are deleted, and is published without them.

    Args:
        tasks: What is to do.
        out: Folder of everything.

    Raises:
        InvalidValueError: There is such an agent.
    """
    for task in tasks:
        tested = [job for job in task.jobs if job.result(out).exists()]
        if task.training is None or not tested or task.training.folder(out).is_dir():
            continue
        message = (
            f"'{tested[0].result(out)}' is there, but not the run that it is of, so '{task.waiting(out)[0].row}' would "
            "be tested with another training of the same agent; choose another --out, or delete this file, too."
        )
        raise InvalidValueError(message)


def _outcome_of(job: Job, out: Path) -> Outcome:
    """Read a job's outcome.

    Raises:
        DamagedFileError: The file holds none, or that of another job.
    """
    path = job.result(out)
    outcome = Outcome.load(path)
    wrong = _what_is_wrong(job, outcome)
    if wrong is not None:
        message = f"'{path}' is not of '{job.row}' with seed {job.seed} ({wrong}); delete it, and it is made again."
        raise DamagedFileError(message)
    return outcome


def _what_is_wrong(job: Job, outcome: Outcome) -> str | None:
    """Say why an outcome cannot be that of a job; None if it can."""
    facts, trials = outcome.facts, len(outcome.success)
    if facts.get("agent") != job.agent:
        return f"it is of the agent {facts.get('agent')!r}"
    if trials != job.protocol.trials:
        return f"it has {trials} trials in place of {job.protocol.trials}"
    seconds = {"test_seconds": facts.get("test_seconds")}
    if job.training is not None:
        if facts.get("config") != job.test_config.to_json():
            return "it is of another configuration"
        choice = facts.get("choice")
        seconds["training_seconds"] = facts.get("training_seconds")
        seconds["choice.seconds"] = choice.get("seconds") if isinstance(choice, dict) else None
    missing = [name for name, value in seconds.items() if not isinstance(value, int | float)]
    return f"it lacks {missing[0]}" if missing else None


def _refuse_two_trainings(jobs: Sequence[Job], outcomes: Mapping[str, Mapping[int, Outcome]], out: Path) -> None:
    """Refuse outcomes that share a training by name but not in fact: their difference would pass for the test's.

    Raises:
        InvalidValueError: There are such.
    """
    first: dict[Path, Job] = {}
    for job in jobs:
        if job.training is None or job.seed not in outcomes[job.row]:
            continue
        other = first.setdefault(job.training.folder(out), job)
        if _differ(outcomes[job.row][job.seed].facts, outcomes[other.row][other.seed].facts):
            message = (
                f"'{other.result(out)}' and '{job.result(out)}' should be of one agent, and are of two "
                "trainings of it, so they cannot be compared; delete the older one, and what it held is done again."
            )
            raise InvalidValueError(message)


def _differ(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Tell whether outcomes are surely not of the same checkpoint of the same run. Older ones lack its digest."""
    digests = {one["choice"].get("sha256"), other["choice"].get("sha256")} - {None}
    return len(digests) > 1 or one["training_seconds"] != other["training_seconds"]
