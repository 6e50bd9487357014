"""`hoz-dist graph`: build, show, convert and plot scene graphs, and plan on them."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hoz_dist.cli.options import cache_option, echo_json, force_option
from hoz_dist.graph.planner import DEFAULT_EDGE_COST, EDGE_COSTS, EdgeCost

if TYPE_CHECKING:
    from hoz_dist.nav.rooms import RoomId
    from hoz_dist.sim.room_views import RoomViews

_FILE = click.Path(path_type=Path)
_scene_option = click.option(
    "--scene", metavar="NAME", help="Scene of a .mat file, which does not hold it. Default: guessed from its name."
)
_top_option = click.option(
    "--top", type=click.IntRange(min=1), default=5, show_default=True, help="Objects to name per zone, a number."
)


@click.group("graph")
def graph_group() -> None:
    """Build, show, convert and plot scene graphs, and plan on them.

    Files may be .json, .msgpack or the released .mat.
    """


@graph_group.command("build")
@click.argument("names", metavar="SCENE|ROOM...", nargs=-1, required=True)
@click.option("--output", type=_FILE, metavar="FILE", help="File to write. Default: SCENE.json in this folder.")
@click.option("--zones", type=int, default=8, show_default=True, help="K, the number of zones, 1 to 64.")
@cache_option
@force_option
def build_command(*, names: tuple[str, ...], output: Path | None, zones: int, cache: Path | None, force: bool) -> None:
    """Explore rooms of one scene and merge their graphs into a scene graph.

    SCENE such as kitchen stands for all its training rooms, ROOM such as kitchen/3 for one.
    """
    from hoz_dist.atomic import check_writable
    from hoz_dist.cli.progress import Progress
    from hoz_dist.errors import InvalidValueError
    from hoz_dist.graph.checks import check_zone_count
    from hoz_dist.graph.files import format_of, save_graph
    from hoz_dist.graph.room_graph import explore_room
    from hoz_dist.graph.scene_graph import merge_rooms
    from hoz_dist.nav.rooms import training_rooms

    rooms = training_rooms(names)
    scene = rooms[0].scene
    if rooms[-1].scene != scene:
        message = f"A scene graph is of one scene, but these are of {scene} and {rooms[-1].scene}; build one at a time."
        raise InvalidValueError(message)
    # All that can be wrong is checked before the long work.
    check_zone_count(zones)
    path = output if output is not None else Path(f"{scene}.json")
    format_of(path)
    check_writable(path, overwrite=force)

    graphs = []
    with Progress("Exploring", len(rooms), unit=None) as progress:
        for count, room in enumerate(rooms):
            note = f"{room}, {count + 1} of {len(rooms)} rooms"

            def rendered(done: int, total: int, count: int = count, note: str = note) -> None:
                progress.update(count + done / total, note)

            views = _views_of(room, cache, rendered)
            graphs.append(
                explore_room(
                    str(room),
                    views.digest,
                    transitions=views.graph.transitions,
                    positions=views.graph.positions,
                    bags=views.bag,
                    zones=zones,
                )
            )
            progress.update(count + 1, note)
    save_graph(merge_rooms(scene, graphs, version=0), path, overwrite=force)
    click.echo(f"Wrote {path}: {zones} zones of {len(rooms)} {'room' if len(rooms) == 1 else 'rooms'} of {scene}.")
    click.echo(f"Try: hoz-dist graph show {path}")


@graph_group.command("show")
@click.argument("file", type=_FILE)
@click.option(
    "--format",
    "output_format",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="Tables for people, or the graph as JSON.",
)
@_top_option
@_scene_option
def show_command(*, file: Path, output_format: str, top: int, scene: str | None) -> None:
    """Show the zones of a scene graph, what is seen in them and how close they are."""
    from hoz_dist.graph.files import encode_graph, load_graph

    graph = load_graph(file, scene)
    if output_format == "json":
        click.echo(encode_graph(graph, "json").decode())
        return
    from rich.console import Console

    from hoz_dist.cli.graph_text import edge_table, title, zone_table

    console = Console()
    console.print(title(graph), markup=False, highlight=False)
    console.print(zone_table(graph, top))
    console.print(edge_table(graph))


@graph_group.command("plan")
@click.argument("file", type=_FILE)
@click.option("--target", required=True, metavar="CATEGORY", help="Object to find, such as Microwave.")
@click.option("--seen", required=True, metavar="A,B,...", help="Objects that are seen now, such as Sink,Toaster.")
@click.option(
    "--edge-cost",
    type=click.Choice(EDGE_COSTS),
    default=DEFAULT_EDGE_COST,
    show_default=True,
    help="Best path: the largest product of edges, or the least sum of costs normalised to 0..1 (released code).",
)
@click.option(
    "--format",
    "output_format",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="Sentences for people, or the plan as JSON.",
)
@_scene_option
def plan_command(
    *, file: Path, target: str, seen: str, edge_cost: EdgeCost, output_format: str, scene: str | None
) -> None:
    """Plan from the zone that fits what is seen to the zone where the target is likely to be."""
    from hoz_dist.cli.graph_text import plan_text
    from hoz_dist.graph.files import load_graph
    from hoz_dist.graph.planner import plan_for

    graph = load_graph(file, scene)
    names = [name.strip() for name in seen.split(",") if name.strip()]
    plan = plan_for(graph, target, names, edge_cost)
    if output_format == "json":
        echo_json(plan.as_dict())
    else:
        click.echo(plan_text(graph, plan, target))


@graph_group.command("convert")
@click.argument("source", metavar="IN", type=_FILE)
@click.argument("output", metavar="OUT", type=_FILE)
@_scene_option
@force_option
def convert_command(*, source: Path, output: Path, scene: str | None, force: bool) -> None:
    """Convert a scene graph between .json, .msgpack and .mat, to the last bit.

    A .mat file has no place for the scene, the version and the rooms: converting to it loses them.
    """
    from hoz_dist.graph.files import load_graph, save_graph

    save_graph(load_graph(source, scene), output, overwrite=force)
    click.echo(f"Wrote {output}.")


@graph_group.command("plot")
@click.argument("file", type=_FILE)
@click.option("--output", type=_FILE, metavar="FILE.png", help="File to write. Default: FILE's name with .png.")
@click.option("--room", metavar="ROOM", help="Also draw a room, such as kitchen/3, from above with its zones.")
@_top_option
@_scene_option
@cache_option
@force_option
def plot_command(
    *, file: Path, output: Path | None, room: str | None, top: int, scene: str | None, cache: Path | None, force: bool
) -> None:
    """Draw a scene graph: its zones, what is seen in them and how close they are."""
    from hoz_dist.atomic import check_writable, write_atomically
    from hoz_dist.errors import InvalidValueError
    from hoz_dist.graph.files import load_graph
    from hoz_dist.graph.update import current_zone
    from hoz_dist.nav.categories import TARGETS
    from hoz_dist.nav.rooms import RoomId
    from hoz_dist.viz.zones import png, room_figure, scene_graph_figure

    graph = load_graph(file, scene)
    path = output if output is not None else file.with_suffix(".png")
    if path.suffix.lower() != ".png":
        message = f"Pictures are written as PNG; name a file that ends in .png, not '{path}'."
        raise InvalidValueError(message)
    check_writable(path, overwrite=force)
    if room is None:
        figure = scene_graph_figure(graph, top)
    else:
        if graph.categories != TARGETS:
            message = f"The objects of '{file}' are not the {len(TARGETS)} targets that rooms are seen by."
            raise InvalidValueError(message)
        views = _views_of(RoomId.parse(room), cache)
        zone_of_view = current_zone(graph.nodes, views.bag)
        figure = room_figure(graph, str(views.room), views.graph.positions, zone_of_view, top)
    write_atomically(path, png(figure), overwrite=force)
    click.echo(f"Wrote {path}.")


def _views_of(room: "RoomId", cache: Path | None, progress: "Callable[[int, int], None] | None" = None) -> "RoomViews":
    """Open the views of a room, rendering what the cache lacks."""
    from hoz_dist.policy.encoders.pooled import PooledEncoder
    from hoz_dist.sim.view_store import ViewStore

    return ViewStore(cache).open(room, PooledEncoder(), progress)
