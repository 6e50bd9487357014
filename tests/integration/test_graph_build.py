"""`hoz-dist graph build` and `plot --room` on a real PyBullet room."""

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from hoz_dist.cli.graph import graph_group
from hoz_dist.graph.files import load_graph

pytestmark = pytest.mark.integration


def run(*arguments: object) -> Result:
    result = CliRunner().invoke(graph_group, [str(argument) for argument in arguments])
    assert result.exception is None, result.output
    return result


def test_graph_of_a_room_is_built_the_same_twice_and_drawn(cache: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.json", tmp_path / "second.json"
    for path in (first, second):
        run("build", "bathroom/1", "--output", path, "--cache", cache)
    assert first.read_bytes() == second.read_bytes()
    graph = load_graph(first)
    assert (graph.scene, graph.rooms, graph.zones) == ("bathroom", ("bathroom/1",), 8)
    assert graph.nodes[:, graph.category("Sink")].max() > 0.5  # bathrooms have a sink, and some zone is about it

    run("plot", first, "--room", "bathroom/1", "--cache", cache)
    assert first.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
