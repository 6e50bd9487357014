"""The options that make up a run's configuration; `hoz-dist learner` and `hoz-dist train` share them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeVar

import click

from hoz_dist.cli.options import picture_size_option, weights_option
from hoz_dist.config import PRESET_LEARNING_RATES, PRESET_PRECISIONS, RunConfig
from hoz_dist.policy.methods import METHODS

F = TypeVar("F", bound=Callable[..., Any])

_MODELS: Final = "; ".join(f"{method.name} ({method.summary})" for method in METHODS.values())
_OPTIONS: Final = (
    click.option(
        "--model",
        "method",
        default=RunConfig.method,
        show_default=True,
        help=f"What guides the agent: {_MODELS}.",
    ),
    click.option(
        "--without",
        multiple=True,
        help="Layer of the model to switch off: object, scene, zone, done (the done reminder) or tpn; may be repeated.",
    ),
    click.option(
        "--relations",
        type=click.Path(dir_okay=False, path_type=Path),
        help="Related categories for --model sp: JSON such as [[a, relation, b, count], ...], or relationships.json of "
        "Visual Genome.  [default: counted in the training rooms]",
    ),
    click.option(
        "--preset",
        default=RunConfig.preset,
        show_default=True,
        help="Sizes of the network: compact, medium (twice the LSTM) or paper.",
    ),
    click.option(
        "--precision",
        help="Of the LSTM's matrix products in training: fp32, or bf16, where the processor has it.  "
        "[default: fp32; bf16 with paper]",
    ),
    click.option("--encoder", default=RunConfig.encoder, show_default=True, help="Visual encoder: pooled or resnet18."),
    weights_option,
    picture_size_option,
    click.option(
        "--zones", type=int, metavar="K", default=RunConfig.zones, show_default=True, help="Zones of a graph."
    ),
    click.option(
        "--edge-cost",
        default=RunConfig.edge_cost,
        show_default=True,
        help="What makes a path over zones short: product or normalized.",
    ),
    click.option(
        "--seed", type=int, default=RunConfig.seed, show_default=True, help="Seed of the parameters and the episodes."
    ),
    click.option(
        "--learning-rate",
        type=float,
        help="Adam's step size at the start; falls linearly to 0 over the budget.  [default: 0.001; 0.0001 with paper]",
    ),
    click.option(
        "--approach-weight",
        type=float,
        default=RunConfig.approach_weight,
        show_default=True,
        help="Weight at the start of imitating shortest paths, in training, once the target was seen; 0 for none.",
    ),
    click.option(
        "--approach-frames",
        type=int,
        default=RunConfig.approach_frames,
        show_default=True,
        help="Frames over which that weight falls linearly to 0.",
    ),
    click.option(
        "--learn-from",
        default=RunConfig.learn_from,
        show_default=True,
        help="What actors push: gradients, or rollouts (some tens of bytes a frame), whose gradients the learner then "
        "computes itself.",
    ),
    click.option(
        "--compress",
        default=RunConfig.compress,
        show_default=True,
        help="How gradients travel: fp32 (4 bytes a parameter), bf16 (2), int8 (1) or topk (the largest 1%).",
    ),
    click.option(
        "--parameters",
        default=RunConfig.parameters,
        show_default=True,
        help="How parameters travel: full (4 bytes a parameter), or delta (1), the difference to an earlier version.",
    ),
    click.option(
        "--max-lag",
        type=int,
        default=RunConfig.max_lag,
        show_default=True,
        help="Largest policy lag of a gradient that is applied, parameter versions; of a rollout twice as much and 1.",
    ),
)


def run_options(command: F) -> F:
    """Give a command the options of a run's configuration; it takes them as keywords, for `run_config`."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def run_config(choices: Mapping[str, Any]) -> RunConfig:
    """Return the configuration that the options say.

    Args:
        choices: Values of the options, and ``minutes`` and ``frames``.

    Raises:
        HozError: A value does not exist or is out of range, or the encoder or the relations cannot be loaded.
    """
    from hoz_dist.policy.encoders import load_encoder
    from hoz_dist.policy.relations import read_relations

    values = dict(choices)
    weights: Path | None = values.pop("weights")
    learning_rate: float | None = values.pop("learning_rate")
    precision: str | None = values.pop("precision")
    if precision is not None:
        values["precision"] = precision
    relations: Path | None = values.pop("relations")
    if relations is not None:
        values["relations"] = read_relations(relations)
    config = RunConfig(**values)  # checks the names before they are used below
    encoder = load_encoder(config.encoder, weights)
    return replace(
        config,
        precision=PRESET_PRECISIONS[config.preset] if precision is None else config.precision,
        learning_rate=PRESET_LEARNING_RATES[config.preset] if learning_rate is None else learning_rate,
        encoder_key=encoder.key,
        channels=encoder.channels,
    )


def as_arguments(choices: Mapping[str, Any]) -> list[str]:
    """Return options as words of a command line; those without a value are left out."""
    words: list[str] = []
    for name, value in choices.items():
        option = "--model" if name == "method" else f"--{name.replace('_', '-')}"
        for single in value if isinstance(value, tuple) else (value,):
            words += [] if single is None else [option, str(single)]
    return words
