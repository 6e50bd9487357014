"""Jobs: one row of a table, trained with one seed and tested; what makes two of them the same, and where they are kept.

A job is known by digests of everything that shapes it, so a table finds what any other table has trained or tested:

    runs/hoz-0123456789ab/seed-0/                  the run folder of a training
    runs/hoz-0123456789ab/seed-0.config.json       its configuration
    runs/hoz-0123456789ab/seed-0.choice-*.json     the checkpoint that the validation rooms chose
    results/hoz-ba9876543210/seed-0.json           what came of every test episode
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from hoz_dist.config import RunConfig
from hoz_dist.evaluation.protocol import EPISODE_SEED, TEMPERATURE
from hoz_dist.nav.categories import scenes_to_tell
from hoz_dist.nav.reward import STEP_REWARD, SUCCESS_REWARD
from hoz_dist.nav.rooms import RoomId, Split, rooms_of, training_rooms
from hoz_dist.reproduce.budget import Budget
from hoz_dist.reproduce.row import BASELINES, Row, Table
from hoz_dist.sim.catalogue import recorded_digest

RECIPE: Final = 2
"""Raise it when training or evaluation change in a way that no digest here tells, so that all is done again."""
_DIGEST_LETTERS: Final = 12


@dataclass(frozen=True)
class Training:
    """One run of the service: a configuration, its seed and frames included, in some rooms."""

    config: RunConfig
    scenes: tuple[str, ...]
    """Scenes or rooms to train in."""
    checkpoints: int
    """How many it keeps on its way."""

    @property
    def frames(self) -> int:
        """The budget of frames."""
        return self.config.frames or 0

    @property
    def keep_every(self) -> int:
        """Frames between two checkpoints that are kept."""
        return max(1, self.frames // self.checkpoints)

    @property
    def digest(self) -> str:
        """Tells this training from others of whatever seed."""
        values = self.config.distinguishing()
        del values["seed"]
        return _digest(
            {
                "recipe": RECIPE,
                "config": values,
                "sizes": asdict(self.config.policy.sizes),
                "rewards": [STEP_REWARD, SUCCESS_REWARD],
                "rooms": _content(training_rooms(self.scenes)),
                "keep": self.keep_every,
            }
        )

    def folder(self, out: Path) -> Path:
        """Return its run folder."""
        return out / "runs" / f"{self.config.method}-{self.digest}" / f"seed-{self.config.seed}"


@dataclass(frozen=True)
class Protocol:
    """How agents are chosen and tested."""

    scenes: tuple[str, ...]
    candidates: int
    validation_episodes: int
    """In each scene."""
    test_episodes: int
    """In each scene."""
    trials: int

    def rooms(self, split: Split) -> tuple[RoomId, ...]:
        """Return the rooms of a split."""
        return tuple(room for scene in self.scenes for room in rooms_of(scene, split))

    @property
    def choice_digest(self) -> str:
        """Tells how a checkpoint is chosen."""
        episodes = [self.validation_episodes, EPISODE_SEED, _content(self.rooms("val"))]
        return _digest([self.candidates, TEMPERATURE, episodes])


@dataclass(frozen=True)
class Job:
    """What a row takes for one seed: a training, which other jobs may share, and a test of its own."""

    row: str = field(compare=False)
    """Name of the row, for people; jobs of several rows may be the same."""
    agent: str
    training: Training | None
    """None for agents that are not trained."""
    protocol: Protocol
    tested_with: tuple[tuple[str, Any], ...] = ()
    """Fields of the configuration that are changed for the test."""

    @property
    def seed(self) -> int:
        """Seed of the training; 0 without one."""
        return 0 if self.training is None else self.training.config.seed

    @property
    def digest(self) -> str:
        """Tells this job from others of whatever seed."""
        protocol = self.protocol
        test = [protocol.test_episodes, protocol.trials, EPISODE_SEED, _content(protocol.rooms("test"))]
        if self.training is None:
            return _digest([RECIPE, self.agent, test])
        return _digest([self.training.digest, protocol.choice_digest, test, TEMPERATURE, sorted(self.tested_with)])

    @property
    def test_config(self) -> RunConfig:
        """The configuration that the agent is tested with; the default one for agents that are not trained."""
        return RunConfig() if self.training is None else replace(self.training.config, **dict(self.tested_with))

    def result(self, out: Path) -> Path:
        """Return the file that keeps what came of the test."""
        return out / "results" / f"{self.agent}-{self.digest}" / f"seed-{self.seed}.json"

    def choice(self, out: Path) -> Path:
        """Return the file that says which checkpoint was chosen, of a job with a training."""
        if self.training is None:
            message = f"'{self.agent}' is not trained"
            raise ValueError(message)
        folder = self.training.folder(out)
        return folder.with_name(f"{folder.name}.choice-{self.protocol.choice_digest}.json")


@dataclass(frozen=True)
class Task:
    """What one process does at a stretch: a training, if there is any, and all tests of its agent."""

    training: Training | None
    jobs: tuple[Job, ...]

    @property
    def name(self) -> str:
        """Which agent it is about, for people; that of the first row when several share the training."""
        job = self.jobs[0]
        return job.row if self.training is None else f"{job.row}, seed {job.seed}"

    def waiting(self, out: Path) -> tuple[Job, ...]:
        """Return the jobs that have no result yet."""
        return tuple(job for job in self.jobs if not job.result(out).exists())


def jobs_of(table: Table, row: Row, budget: Budget, seeds: Sequence[int] | None = None) -> tuple[Job, ...]:
    """Return the jobs of a row, one for each seed.

    Args:
        table: The row's table.
        row: The row.
        budget: What every row gets.
        seeds: Seeds to train with; those of the budget if None.

    Raises:
        UnknownNameError: The row's method or one of its options does not exist.
        InvalidValueError: An option is out of range.
    """
    scenes = table.test_scenes
    protocol = Protocol(
        scenes,
        budget.candidates,
        max(1, budget.validation_episodes // len(scenes)),
        max(1, budget.test_episodes // len(scenes)),
        # Oracle draws nothing, so its trials would all be the same.
        1 if row.agent == "oracle" else budget.trials,
    )
    if row.agent in BASELINES:
        return (Job(row.name, row.agent, None, protocol),)
    wanted = seeds_of(row, budget) if seeds is None else seeds
    frames = budget.frames(table.scenes)
    recipe = RunConfig(preset="medium", frames=frames, approach_frames=frames, scenes=scenes_to_tell(scenes))
    config = RunConfig.from_json(recipe.to_json() | {"method": row.agent, **_as_json(row.options)})
    trainings = (Training(replace(config, seed=seed), table.scenes, budget.checkpoints) for seed in wanted)
    tested_with = tuple(sorted(row.tested_with.items()))
    return tuple(Job(row.name, row.agent, training, protocol, tested_with) for training in trainings)


def seeds_of(row: Row, budget: Budget) -> range:
    """Return the seeds that a budget has a row trained with."""
    return range(budget.more_seeds if row.more_seeds else budget.seeds)


def tasks_of(jobs: Iterable[Job], out: Path) -> tuple[Task, ...]:
    """Put jobs together that share a training, each job once.

    Tasks come by seed: a table that is stopped has all rows with few seeds rather than few rows with all.

    Args:
        jobs: Of all rows.
        out: Folder of everything.
    """
    groups: dict[Path, dict[Path, Job]] = {}
    for job in jobs:
        place = job.result(out) if job.training is None else job.training.folder(out)
        groups.setdefault(place, {}).setdefault(job.result(out), job)
    tasks = [Task(next(iter(group.values())).training, tuple(group.values())) for group in groups.values()]
    return tuple(sorted(tasks, key=lambda task: task.jobs[0].seed))


def rooms_needed(tasks: Iterable[Task]) -> list[RoomId]:
    """Return the rooms that tasks train, choose and test in, each once."""
    rooms: dict[RoomId, None] = {}
    for task in tasks:
        if task.training is not None:
            rooms |= dict.fromkeys(training_rooms(task.training.scenes))
        for job in task.jobs:
            rooms |= dict.fromkeys((*job.protocol.rooms("val"), *job.protocol.rooms("test")))
    return list(rooms)


def _as_json(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in options.items()}


def _content(rooms: Iterable[RoomId]) -> list[list[str]]:
    """Return what tells whether rooms are the same as before: names and digests of their content."""
    return [[str(room), recorded_digest(room)] for room in rooms]


def _digest(value: object) -> str:
    text = json.dumps(value, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_LETTERS]
