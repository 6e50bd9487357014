"""`hoz-dist evaluate`: measure a checkpoint on rooms that it was not trained in."""

from pathlib import Path

import click

from hoz_dist.cli.options import cache_option, echo_json, trial_options, weights_option
from hoz_dist.evaluation.protocol import TEMPERATURE


@click.command("evaluate")
@click.argument("checkpoint", type=click.Path(path_type=Path))
@trial_options(trials=5)
@click.option(
    "--temperature",
    type=click.FloatRange(0.01, 10.0),
    default=TEMPERATURE,
    show_default=True,
    help="Logits are divided by it before actions are drawn: 1 draws as in training, 0.01 takes the likeliest.",
)
@weights_option
@cache_option
@click.option("--live", is_flag=True, help="Render every step in PyBullet instead of looking it up; slow.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, in percent, instead of a table.")
def evaluate_command(
    checkpoint: Path,
    split: str,
    trials: int,
    seed: int,
    episodes: int,
    scenes: tuple[str, ...],
    temperature: float,
    weights: Path | None,
    cache: Path | None,
    *,
    live: bool,
    as_json: bool,
) -> None:
    """Measure CHECKPOINT, a checkpoint file or a run folder, against Random and Oracle.

    All agents run the same fixed list of episodes, and every one of them counts. One seed gives the same numbers again.
    """
    from rich.console import Console

    from hoz_dist.cli.measure import measure
    from hoz_dist.evaluation.table import comparison_table
    from learner.checkpoint import load_checkpoint

    comparison = measure(
        load_checkpoint(checkpoint),
        split="test" if split == "test" else "val",
        seeds=range(seed, seed + trials),
        episodes=episodes,
        scenes=scenes,
        temperature=temperature,
        weights=weights,
        cache=cache,
        live=live,
    ).comparison
    if as_json:
        echo_json(comparison.to_json())
    else:
        Console().print(comparison_table(comparison))
