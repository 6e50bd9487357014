"""The table of a comparison, for people."""

from typing import Any

from rich.table import Table

from hoz_dist.evaluation.benchmark import Comparison


def comparison_table(comparison: Comparison) -> Table:
    """Show SR, SPL and SAE of the agents by scene, for all episodes and the long ones, in percent."""
    policy = comparison.policy
    rooms = {"val": "validation", "test": "test"}.get(policy.split, policy.split)
    trials = len(policy.trials)
    drawn = "one trial" if trials == 1 else f"mean and standard deviation of {trials} trials"
    table = Table(
        title=f"{policy.method} on unseen {rooms} rooms, percent",
        caption=f"{policy.episodes} fixed episodes, every one counted; {drawn}. L>=5: at least 5 actions away.",
    )
    for heading in ("scene", "agent"):
        table.add_column(heading, no_wrap=True)
    for heading in ("SR", "SPL", "SAE", "L>=5: SR", "SPL", "SAE"):
        table.add_column(heading, justify="right", no_wrap=True)
    for scene in (*comparison.scenes, None):
        for row in comparison.rows:
            figures = (row if scene is None else row.of_scene(scene)).to_json()
            cells = [*_cells(figures["all"]), *_cells(figures["long"])]
            style = "bold" if row is policy else None
            table.add_row((scene or "all") if row is comparison.random else "", row.method, *cells, style=style)
        table.add_section()
    return table


def _cells(figures: dict[str, Any]) -> list[str]:
    def cell(name: str) -> str:
        mean, deviation = figures[name]["mean"], figures[name]["std"]
        return f"{mean:.1f}±{deviation:.1f}" if deviation else f"{mean:.1f}"

    return [cell("sr"), cell("spl"), cell("sae")]
