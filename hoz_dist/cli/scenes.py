"""`hoz-dist scenes`: what rooms there are, what is in them, and rendering their views ahead of training."""

import os
from collections import Counter
from pathlib import Path
from typing import Any, get_args

import click

from hoz_dist.cli.options import cache_option, echo_json, force_option, json_option, picture_size_option
from hoz_dist.nav.categories import SCENE_TARGETS, SCENES, TARGETS
from hoz_dist.nav.rooms import SPLITS, RoomId, Split, rooms_of


@click.group("scenes")
def scenes_group() -> None:
    """List, show and render the rooms."""


@scenes_group.command("list")
@json_option
def list_command(*, as_json: bool) -> None:
    """List the scenes, the rooms of each split, and the targets of each scene."""
    if as_json:
        scenes = [
            {
                "scene": scene,
                "splits": {split: [numbers.start, numbers.stop - 1] for split, numbers in SPLITS[scene].items()},
                "targets": list(SCENE_TARGETS[scene]),
            }
            for scene in SCENES
        ]
        echo_json({"scenes": scenes, "categories": list(TARGETS)})
        return
    kinds = {"train": "to train in", "val": "for validation", "test": "for the test"}
    click.echo("A room is named like kitchen/3.\n")
    for scene in SCENES:
        rooms = ", ".join(
            f"{numbers.start}-{numbers.stop - 1} {kinds[split]}" for split, numbers in SPLITS[scene].items()
        )
        click.echo(f"{scene}: rooms {rooms}; {len(SCENE_TARGETS[scene])} targets")
        click.echo(f"    {' '.join(SCENE_TARGETS[scene])}")


@scenes_group.command("show")
@click.argument("room", metavar="ROOM")
@json_option
def show_command(room: str, *, as_json: bool) -> None:
    """Show what is in a room: its size, its objects, its targets and where the agent can stand."""
    facts = _facts(RoomId.parse(room))
    if as_json:
        echo_json(facts)
        return
    items = ", ".join(name if count == 1 else f"{count} {name}" for name, count in facts["items"].items())
    click.echo(
        f"{facts['room']} ({facts['split']}): {facts['width']:.2f} m x {facts['depth']:.2f} m\n"
        f"items:     {items}\n"
        f"targets:   {', '.join(facts['targets'])}\n"
        f"positions: {facts['positions']} that the agent can reach, {facts['views']} views\n"
        f"digest:    {facts['digest']}"
    )


@scenes_group.command("render")
@click.argument("names", metavar="ROOM|SCENE...", nargs=-1, required=True)
@click.option(
    "--split",
    type=click.Choice(get_args(Split)),
    default="train",
    show_default=True,
    help="Which rooms of a SCENE; a ROOM stands for itself.",
)
@picture_size_option
@click.option(
    "--jobs",
    type=click.IntRange(1, 256),
    default=len(os.sched_getaffinity(0)),
    show_default="number of cores",
    help="Processes that render at once.",
)
@cache_option
@click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Also write a picture (PNG) with some views of each room.",
)
@force_option
def render_command(
    names: tuple[str, ...],
    split: Split,
    picture_size: int,
    jobs: int,
    cache: Path | None,
    output: Path | None,
    *,
    force: bool,
) -> None:
    """Render all views of rooms into the view cache, so that training and evaluation need not wait for them.

    Views that are there already are kept.
    """
    rooms = list(dict.fromkeys(room for name in names for room in _rooms(name, split)))
    from hoz_dist.atomic import check_writable, write_atomically
    from hoz_dist.cli.rendering import Encoding, contact_sheet, render_rooms
    from hoz_dist.sim.view_store import ViewStore, default_cache

    if output is not None:
        check_writable(output, overwrite=force)  # before minutes of work, not after
    folder = cache or default_cache()
    views = render_rooms(rooms, folder, picture_size, jobs, Encoding())
    click.echo(f"The cache {folder} holds all {views:,} views of {len(rooms)} room{'s' * (len(rooms) != 1)}.")
    if output is not None:
        write_atomically(output, contact_sheet(rooms, ViewStore(folder, picture_size)), overwrite=force)
        click.echo(f"Wrote {output}.")


def _rooms(name: str, split: Split) -> tuple[RoomId, ...]:
    return (RoomId.parse(name),) if "/" in name else rooms_of(name, split)


def _facts(name: RoomId) -> dict[str, Any]:
    """Collect what `scenes show` says of a room."""
    from hoz_dist.sim.catalogue import load_room, targets_of
    from hoz_dist.sim.pose_graph import build_pose_graph
    from hoz_dist.sim.world import World

    room = load_room(name)
    with World(room) as world:
        graph = build_pose_graph(world)
    return {
        "room": str(name),
        "split": name.split,
        "width": room.width,
        "depth": room.depth,
        "items": dict(sorted(Counter(item.category for item in room.items).items())),
        "targets": [TARGETS[target] for target in targets_of(room)],
        "positions": len(graph.positions),
        "views": graph.views,
        "digest": room.digest,
    }
