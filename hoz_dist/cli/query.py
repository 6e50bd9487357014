"""`hoz-dist query`: asks a learner for a scene graph, a room graph or a plan."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from hoz_dist.cli.connecting import READERS, connect_option, credentials_in, keys_option, run_option
from hoz_dist.cli.options import force_option
from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.categories import category_index, scene_index
from hoz_dist.nav.rooms import RoomId

if TYPE_CHECKING:
    from hoz_dist.client import HozClient
    from hoz_dist.graph.scene_graph import SceneGraph

_FORMATS: Final = ("table", "json", "msgpack", "mat", "dot")
_EXTENSIONS: Final = {f".{name}": name for name in _FORMATS[1:]}
_BINARY: Final = frozenset({"msgpack", "mat"})
_PLAN_FORMATS: Final = frozenset({"table", "json", "msgpack"})
_TOP: Final = 5
"""Objects named for each zone."""


@click.command("query")
@click.argument("name", metavar="SCENE|ROOM")
@connect_option
@keys_option
@run_option
@click.option("--target", metavar="CATEGORY", help="Object to find: asks for a plan. Needs --seen.")
@click.option("--seen", metavar="A,B,...", help="Objects that are seen now, such as Sink,Toaster. Needs --target.")
@click.option(
    "--format",
    "chosen",
    type=click.Choice(_FORMATS),
    help="How to print it.  [default: by the extension of --output, else table]",
)
@click.option("--output", type=click.Path(path_type=Path), metavar="FILE", help="Write to a file instead of printing.")
@force_option
def query_command(
    *,
    name: str,
    connect: str,
    keys: Path | None,
    run: str | None,
    target: str | None,
    seen: str | None,
    chosen: str | None,
    output: Path | None,
    force: bool,
) -> None:
    """Ask a learner for the graph of SCENE (kitchen) or ROOM (kitchen/3), or for a plan in SCENE.

    Examples: hoz-dist query kitchen --format json

    hoz-dist query kitchen --target Microwave --seen Sink,Toaster
    """
    from hoz_dist.client import HozClient

    shape = chosen or _format_of(output)
    if output is not None:
        from hoz_dist.atomic import check_writable

        check_writable(output, overwrite=force)
    elif shape in _BINARY and sys.stdout.isatty():
        message = f"{shape} is no text for a terminal; add --output FILE, or pipe it to another program."
        raise InvalidValueError(message)
    if (target is None) != (seen is None):
        message = "A plan needs both --target, the object to find, and --seen, what is seen now."
        raise InvalidValueError(message)
    # What is wrong with the names is said before anybody is asked.
    if "/" in name:
        RoomId.parse(name)
    else:
        scene_index(name)
    wanted = _names(seen) if seen is not None else []
    for category in [*wanted, *([] if target is None else [target])]:
        category_index(category)

    with HozClient(connect, run, credentials_in(keys, READERS)) as client:
        if target is None:
            content = _graph_content(_graph(client, name), shape)
        else:
            content = _plan_content(client, name, target, wanted, shape)
    if output is None:
        click.echo(content, nl=False)
        return
    from hoz_dist.atomic import write_atomically

    write_atomically(output, content, overwrite=force)
    click.echo(f"Wrote {output}.")


def _names(text: str) -> list[str]:
    """Split names at commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def _format_of(output: Path | None) -> str:
    """Return the format that an output file's extension asks for."""
    return "table" if output is None else _EXTENSIONS.get(output.suffix.lower(), "table")


def _graph(client: "HozClient", name: str) -> "SceneGraph":
    """Ask for the graph of a scene, or of a room, which is the merge of that one room."""
    if "/" not in name:
        return client.graph(name)
    from hoz_dist.graph.scene_graph import merge_rooms

    return merge_rooms(name.partition("/")[0], [client.room_graph(name)], version=0)


def _graph_content(graph: "SceneGraph", shape: str) -> bytes:
    """Return a graph in a format."""
    from hoz_dist.cli.graph_text import dot, edge_table, title, zone_table
    from hoz_dist.graph.files import encode_graph

    match shape:
        case "json" | "msgpack" | "mat":
            content = encode_graph(graph, shape)
            return content + b"\n" if shape == "json" else content
        case "dot":
            return dot(graph, _TOP).encode() + b"\n"
        case _:
            return _printed(title(graph), zone_table(graph, _TOP), edge_table(graph))


def _plan_content(client: "HozClient", scene: str, target: str, seen: list[str], shape: str) -> bytes:
    """Ask for a plan and return it in a format."""
    if shape not in _PLAN_FORMATS:
        message = f"A plan has no {shape} form; choose one of {', '.join(sorted(_PLAN_FORMATS))}."
        raise InvalidValueError(message)
    plan = client.plan(scene, target, seen)
    match shape:
        case "json":
            import json

            return json.dumps(plan.as_dict()).encode() + b"\n"
        case "msgpack":
            import msgpack

            packed: bytes = msgpack.packb(plan.as_dict())
            return packed
        case _:
            from hoz_dist.cli.graph_text import plan_text

            return plan_text(client.graph(scene), plan, target).encode() + b"\n"


def _printed(*parts: object) -> bytes:
    """Return what rich prints for texts and tables, with colours only on a terminal."""
    from io import StringIO

    from rich.console import Console

    console = Console()
    text = StringIO()
    writer = Console(file=text, force_terminal=console.is_terminal, width=console.width)
    for part in parts:
        writer.print(part, markup=False, highlight=False)
    return text.getvalue().encode()
