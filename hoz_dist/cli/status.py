"""`hoz-dist status`: asks a learner who takes part and how it goes."""

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

import click

from hoz_dist.cli.connecting import connect_option, run_option
from hoz_dist.cli.options import echo_json, json_option

if TYPE_CHECKING:
    from rich.table import Table

_NAMED_ROOMS: Final = 3
"""Rooms of a process that are named one by one."""


@click.command("status")
@connect_option
@run_option
@json_option
def status_command(*, connect: str, run: str | None, as_json: bool) -> None:
    """Show the live processes of a run, the version of its parameters, and what was rejected."""
    from hoz_dist.client import HozClient

    with HozClient(connect, run) as client:
        status = client.status()
    if as_json:
        echo_json(status)
        return
    from rich.console import Console

    console = Console()
    console.print(_headline(status), markup=False, highlight=False)
    console.print(_process_table(status["processes"]))
    rejected = ", ".join(f"{reason} {count}" for reason, count in sorted(status["rejected"].items()))
    console.print(f"Rejected messages: {rejected or 'none'}", markup=False, highlight=False)


def _headline(status: dict[str, Any]) -> str:
    """Say how far the run is; what the learner does not tell is left out."""
    parts = [f"version {status['version']:,} of epoch {status['epoch']}"]
    if isinstance(frames := status.get("frames"), int):
        parts.append(f"{frames:,} frames")
    if isinstance(rate := status.get("frames_per_second"), float | int):
        parts.append(f"{rate:,.0f} frames/s")
    success = status.get("success")
    if isinstance(success, dict) and isinstance(share := success.get("overall"), float | int):
        parts.append(f"success {share:.0%}")
    if isinstance(progress := status.get("progress"), float | int):
        parts.append(f"{progress:.0%} done")
    return ", ".join(parts)


def _rooms_text(rooms: list[str]) -> str:
    """Name a few rooms; count many by scene."""
    if len(rooms) <= _NAMED_ROOMS:
        return ", ".join(rooms)
    scenes = Counter(room.partition("/")[0] for room in rooms)
    return ", ".join(f"{scene} ({count})" for scene, count in scenes.items())


def _process_table(processes: list[dict[str, Any]]) -> "Table":
    """List the holders of a live token."""
    from rich.table import Table

    table = Table("role", "id", "rooms", "frames", "frames/s", "lag", "rejected", title="Live processes")
    for process in processes:
        table.add_row(
            process["role"],
            process["id"],
            _rooms_text(process["rooms"]),
            f"{process['frames']:,}",
            f"{process['frames_per_second']:,.0f}",
            f"{process['lag']:.1f}",
            str(process["rejected"]),
        )
    return table
