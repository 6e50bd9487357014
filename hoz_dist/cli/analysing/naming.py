"""What the methods of runs are called in tables and pictures."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Final, NamedTuple

from hoz_dist.config import RunConfig

_CONTROLS: Final = ("edge_cost", "subgoal", "clustering", "merge_order", "graph_source")
"""Options that change what guides an agent: no run that has them is to pass for its plain method."""
_UNSPOKEN: Final = {"method", "without", "relations", "encoder_key", "channels", "seed"}
"""Fields that a name has already, or that are too long for one or follow from others."""
_SAME_FRAMES: Final = 0.01
"""Share of their frames by which seeds of one method may differ."""


class Training(NamedTuple):
    """All that the seeds of one method have in common."""

    config: RunConfig
    frames: int
    """How long it was trained."""
    rooms: frozenset[tuple[str, str]]
    """Where: names of rooms, and digests of their content."""


def method_names(paths: Sequence[Path], trainings: Sequence[Training]) -> list[str]:
    """Name runs by their methods, the layers that these lack and their options, such as ``hoz-no-done-subgoal-random``.

    Options that change what guides an agent are always named, others only where runs would share a name without them:
    a method has the same plain name in rooms and in apartments, which take more zones. An option that has its default
    value is not named. Runs that nevertheless share a name have the number of their rooms in it where that differs, and
    the frames that they reached. What is then still ambiguous has its path in its name.

    Args:
        paths: Of the runs.
        trainings: What they come from.

    Returns:
        A name for each run; the same for runs of several seeds that have the same configuration and were trained in the
        same rooms, equally long.
    """
    configs = [training.config for training in trainings]
    short = [_name(config, _CONTROLS) for config in configs]
    names = []
    for own, config in zip(short, configs, strict=True):
        sharing = [other for name, other in zip(short, configs, strict=True) if name == own]
        names.append(_name(config, (*_CONTROLS, *_differing(sharing))))
    marks = []
    for own, training in zip(names, trainings, strict=True):
        marks.append(_mark(training, [other for name, other in zip(names, trainings, strict=True) if name == own]))
    names = [f"{name}{mark}" for name, mark in zip(names, marks, strict=True)]
    first = _first_alike(names, trainings)
    ambiguous = {names[one] for one in first for other in first if one != other and names[one] == names[other]}
    return [f"{names[one]} ({paths[one]})" if names[one] in ambiguous else names[one] for one in first]


def _name(config: RunConfig, options: Sequence[str]) -> str:
    """Name a configuration by its method, the layers that it lacks, and those of some options that are no defaults."""
    values = {name: getattr(config, name) for name in options}
    said = [f"-{name.replace('_', '-')}-{value}" for name, value in values.items() if value != getattr(RunConfig, name)]
    return "-no-".join((config.method, *config.without)) + "".join(said)


def _differing(configs: Sequence[RunConfig]) -> list[str]:
    """Return the fields, of those that fit into a name, in which configurations differ."""
    names = [field.name for field in fields(RunConfig) if field.name not in {*_UNSPOKEN, *_CONTROLS}]
    return [name for name in names if len({getattr(config, name) for config in configs}) > 1]


def _mark(training: Training, sharing: Sequence[Training]) -> str:
    """Say how much a run of those that share a name was trained, of what differs between them."""
    stages = {one.frames: _stage(one, sharing) for one in sharing}
    said = []
    if len({len(one.rooms) for one in sharing}) > 1:
        said.append(f"{len(training.rooms)} room" + "s" * (len(training.rooms) != 1))
    if len(set(stages.values())) > 1:
        said.append(f"{stages[training.frames]:,} frames")
    return f" ({', '.join(said)})" if said else ""


def _stage(training: Training, sharing: Sequence[Training]) -> int:
    """Return the frames of the shortest run that counts as trained as long as this one.

    Runs of one budget end within an update of each other, which is more than a small share of a short budget.
    """
    update = training.config.batch * training.config.rollout_steps
    stage = min(one.frames for one in sharing)
    for frames in sorted(one.frames for one in sharing if one.frames <= training.frames):
        if frames - stage > max(_SAME_FRAMES * stage, update):
            stage = frames
    return stage


def _first_alike(names: Sequence[str], trainings: Sequence[Training]) -> list[int]:
    """Return, for each run, the number of the first one that is the same method, of another seed."""
    alike: dict[tuple[str, RunConfig, frozenset[tuple[str, str]]], list[int]] = {}
    for number, (name, training) in enumerate(zip(names, trainings, strict=True)):
        # The name tells how long they were trained.
        alike.setdefault((name, replace(training.config, seed=0), training.rooms), []).append(number)
    first = list(range(len(trainings)))
    for numbers in alike.values():
        # Several checkpoints of one run are no more than one seed, and stay apart.
        if len({trainings[number].config.seed for number in numbers}) == len(numbers):
            for number in numbers:
                first[number] = numbers[0]
    return first
