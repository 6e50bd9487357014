"""How the status of a run reads: tables for a terminal, one line for a log."""

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from hoz_dist.cli.progress import duration

_NAMED_ROOMS: Final = 3
"""Rooms of a process that are named one by one."""
_NAMED_LEFT: Final = 3
"""Processes that left and are named in a line."""
_ORDER: Final = ("learner", "standby", "actor")


def status_page(status: dict[str, Any]) -> RenderableType:
    """Lay out all of a status that people want to see."""
    parts: list[RenderableType] = [Text(headline(status)), _process_table(status["processes"])]
    if left := status["left"]:
        parts.append(_left_table(left))
    if namesakes := _namesakes_line(status["processes"]):
        parts.append(Text(namesakes))
    parts.append(Text(f"Rejected messages: {_counts(status['rejected']) or 'none'}"))
    if busy := status.get("busy"):
        parts.append(Text(f"Told to wait (busy): {busy:,} times"))
    return Group(*parts)


def status_line(status: dict[str, Any]) -> str:
    """Say on one line how the run goes, who takes part and who left."""
    roles = Counter(process["role"] for process in status["processes"])
    parts = [headline(status), *(_plural(roles[role], role) for role in _ORDER if roles[role])]
    if left := status["left"]:
        names = [f"{process['role']} {process['id']}" for process in left[:_NAMED_LEFT]]
        more = [f"{len(left) - _NAMED_LEFT} more"] if len(left) > _NAMED_LEFT else []
        parts.append("left: " + " + ".join(names + more))
    if status["rejected"]:
        parts.append(f"rejected: {_counts(status['rejected'])}")
    if busy := status.get("busy"):
        parts.append(f"busy: {busy:,}")
    line = ", ".join(parts)
    namesakes = _namesakes_line(status["processes"])
    return f"{line}; {namesakes}" if namesakes else line


def headline(status: dict[str, Any]) -> str:
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


def _counts(rejected: dict[str, int]) -> str:
    return ", ".join(f"{reason} {count:,}" for reason, count in sorted(rejected.items()))


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _rooms_text(rooms: list[str]) -> str:
    """Name a few rooms; count many by scene."""
    if len(rooms) <= _NAMED_ROOMS:
        return ", ".join(rooms)
    scenes = Counter(room.partition("/")[0] for room in rooms)
    return ", ".join(f"{scene} ({count})" for scene, count in scenes.items())


def _process_table(processes: list[dict[str, Any]]) -> Table:
    """List the holders of a live token, the leader first."""
    table = Table(title="Live processes", title_justify="left")
    for column in ("role", "id", "host", "rooms"):
        table.add_column(column, overflow="fold")
    for column in ("frames", "frames/s", "lag", "rejected"):
        table.add_column(column, justify="right", overflow="fold")
    ordered = sorted(processes, key=lambda process: _ORDER.index(process["role"]) if process["role"] in _ORDER else 0)
    for process in ordered:
        cells = [process["role"], process["id"], process["host"]]
        if process["role"] == "actor":
            cells += [
                _rooms_text(process["rooms"]),
                f"{process['frames']:,}",
                f"{process['frames_per_second']:,.0f}",
                f"{process['lag']:.1f}",
                f"{process['rejected']:,}",
            ]
        table.add_row(*map(Text, cells))
    return table


def _left_table(left: list[dict[str, Any]]) -> Table:
    """List who left, the last one first."""
    table = Table(title="Left", title_justify="left")
    for column in ("role", "id", "host"):
        table.add_column(column, overflow="fold")
    table.add_column("how long ago", justify="right")
    for process in left:
        cells = (process["role"], process["id"], process["host"], duration(process["seconds"]))
        table.add_row(*map(Text, cells))
    return table


def _namesakes_line(processes: list[dict[str, Any]]) -> str:
    """Point out live actors that share a name; empty when there are none."""
    shared = ", ".join(_namesakes(processes))
    if not shared:
        return ""
    return f"Live actors share a name: {shared}. They play the same episodes; give each a --name of its own."


def _namesakes(processes: list[dict[str, Any]]) -> Iterator[str]:
    hosts: dict[str, list[str]] = {}
    for process in processes:
        if process["role"] == "actor":
            hosts.setdefault(process["id"], []).append(process["host"])
    for name, where in hosts.items():
        if len(where) > 1:
            yield f"{name} on {' and '.join(where)}"
