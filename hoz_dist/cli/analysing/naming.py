"""What the methods of runs are called in tables and pictures."""

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Final

from hoz_dist.config import RunConfig

_CONTROLS: Final = ("edge_cost", "subgoal", "clustering", "merge_order", "graph_source")
"""Options that change what guides an agent: no run that has them is to pass for its plain method."""
_UNSPOKEN: Final = {"method", "without", "relations", "encoder_key", "channels", "seed"}
"""Fields that a name has already, or that are too long for one or follow from others."""


def method_names(paths: Sequence[Path], configs: Sequence[RunConfig]) -> list[str]:
    """Name runs by their methods, the layers that these lack and their options, such as ``hoz-no-done-subgoal-random``.

    Options that change what guides an agent are always named, others only where runs would share a name without them:
    a method has the same plain name in rooms and in apartments, which take more zones. An option that has its default
    value is not named. What is then still ambiguous has its path in its name.

    Args:
        paths: Of the runs.
        configs: Their configurations.

    Returns:
        A name for each run; the same for runs whose configurations differ by the seed, and by the seed alone.
    """
    short = [_name(config, _CONTROLS) for config in configs]
    names = []
    for own, config in zip(short, configs, strict=True):
        sharing = [other for name, other in zip(short, configs, strict=True) if name == own]
        names.append(_name(config, (*_CONTROLS, *_differing(sharing))))
    first = _first_alike(configs)
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


def _first_alike(configs: Sequence[RunConfig]) -> list[int]:
    """Return, for each configuration, the number of the first one that differs from it by the seed at most."""
    alike: dict[RunConfig, list[int]] = {}
    for number, config in enumerate(configs):
        alike.setdefault(replace(config, seed=0), []).append(number)
    first = list(range(len(configs)))
    for numbers in alike.values():
        # Several checkpoints of one run are no more than one seed, and stay apart.
        if len({configs[number].seed for number in numbers}) == len(numbers):
            for number in numbers:
                first[number] = numbers[0]
    return first
