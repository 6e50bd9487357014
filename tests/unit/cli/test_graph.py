import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from hoz_dist.cli.graph import graph_group
from hoz_dist.errors import DamagedFileError, HozError, InvalidValueError, NotFoundError, UnknownNameError
from hoz_dist.graph.files import load_graph, save_graph
from hoz_dist.graph.plain import to_plain
from hoz_dist.graph.planner import EDGE_COSTS, EdgeCost, plan_for
from tests.unit.graph.samples import random_scene_graph


@pytest.fixture
def kitchen(tmp_path: Path) -> Path:
    path = tmp_path / "kitchen.json"
    save_graph(random_scene_graph(), path)
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(graph_group, [str(argument) for argument in arguments])


def output_of(*arguments: object) -> str:
    result = run(*arguments)
    assert result.exception is None, result.output
    return result.stdout


def error_of(*arguments: object) -> HozError:
    error = run(*arguments).exception
    assert isinstance(error, HozError)
    return error


def test_show_as_json_is_the_graph(kitchen: Path) -> None:
    assert json.loads(output_of("show", kitchen, "--format", "json")) == to_plain(random_scene_graph())


def test_show_as_table_names_zones_objects_and_edges(kitchen: Path) -> None:
    graph = load_graph(kitchen)
    text = output_of("show", kitchen, "--top", 1)
    assert "Scene graph of kitchen of 2 rooms, version 3" in text
    assert graph.categories[graph.nodes[0].argmax()] in text
    assert f"{graph.edges[0, 1]:.3f}" in text


def test_show_takes_a_mat_file(kitchen: Path) -> None:
    output_of("convert", kitchen, kitchen.with_name("Living_Rooms.mat"))
    assert "living_room" in output_of("show", kitchen.with_name("Living_Rooms.mat"))
    shown = output_of("show", kitchen.with_name("Living_Rooms.mat"), "--scene", "bedroom", "--format", "json")
    assert json.loads(shown)["scene"] == "bedroom"


@pytest.mark.parametrize("edge_cost", EDGE_COSTS)
def test_plan_as_json_is_the_plan(edge_cost: EdgeCost, kitchen: Path) -> None:
    arguments = ["plan", kitchen, "--target", "microwave", "--seen", "Sink, toaster", "--edge-cost", edge_cost]
    plan = plan_for(random_scene_graph(), "Microwave", ["Sink", "Toaster"], edge_cost)
    assert json.loads(output_of(*arguments, "--format", "json")) == plan.as_dict()


def test_plan_as_text_says_where_to_go(kitchen: Path) -> None:
    plan = plan_for(random_scene_graph(), "Microwave", ["Sink"])
    text = output_of("plan", kitchen, "--target", "microwave", "--seen", "Sink")
    assert f"You are in zone {plan.current} (" in text
    assert f"Microwave is most likely in zone {plan.target} (" in text
    assert f"Go to zone {plan.subgoal} (" in text


def test_plan_from_the_target_zone_says_to_look_around(tmp_path: Path) -> None:
    save_graph(random_scene_graph(zones=1), tmp_path / "graph.json")
    text = output_of("plan", tmp_path / "graph.json", "--target", "Sink", "--seen", "Sink")
    assert "Look around here." in text
    assert "Path: 0, probability 1." in text


@pytest.mark.parametrize("seen", ["", ",", " , "])
def test_plan_needs_something_seen(seen: str, kitchen: Path) -> None:
    assert isinstance(error_of("plan", kitchen, "--target", "Sink", "--seen", seen), InvalidValueError)


@pytest.mark.parametrize(("target", "seen"), [("Unicorn", "Sink"), ("Sink", "Sink,Unicorn")])
def test_plan_refuses_unknown_objects(target: str, seen: str, kitchen: Path) -> None:
    error = error_of("plan", kitchen, "--target", target, "--seen", seen)
    assert isinstance(error, UnknownNameError)
    assert "Unicorn" in str(error)


def test_convert_there_and_back_gives_the_same_graph(kitchen: Path) -> None:
    packed, back = kitchen.with_suffix(".msgpack"), kitchen.with_name("back.json")
    output_of("convert", kitchen, packed)
    output_of("convert", packed, back)
    assert back.read_bytes() == kitchen.read_bytes()


def test_existing_output_is_kept_unless_forced(kitchen: Path) -> None:
    taken = kitchen.with_name("taken.json")
    taken.write_text("mine")
    picture = kitchen.with_suffix(".png")
    picture.write_text("mine")
    for arguments in (
        ("convert", kitchen, taken),
        ("plot", kitchen),
        ("build", "kitchen/1", "--output", taken),
    ):
        assert "exists already" in str(error_of(*arguments))
    assert taken.read_text() == picture.read_text() == "mine"
    output_of("convert", kitchen, taken, "--force")
    assert load_graph(taken).zones == 8


def test_plot_writes_a_picture(kitchen: Path) -> None:
    output_of("plot", kitchen)
    assert kitchen.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_plot_writes_png_only(kitchen: Path) -> None:
    assert "ends in .png" in str(error_of("plot", kitchen, "--output", kitchen.with_suffix(".pdf")))


def test_files_that_hold_no_graph_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.json").touch()
    for command in (["show"], ["plan", "--target", "Sink", "--seen", "Sink"], ["plot"]):
        assert isinstance(error_of(*command, tmp_path / "none.json"), NotFoundError)
        assert isinstance(error_of(*command, tmp_path / "empty.json"), DamagedFileError)
        assert isinstance(error_of(*command, tmp_path), DamagedFileError)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["attic"], "Unknown scene 'attic'"),
        (["kitchen/99"], "Unknown room 'kitchen/99'"),
        (["kitchen/25"], "kept for validation"),
        (["kitchen/1", "bedroom/1"], "one at a time"),
        (["kitchen/1", "--zones", "0"], "number of zones must be 1 to 64"),
        (["kitchen/1", "--output", "graph.txt"], "must end in"),
        (["kitchen/1", "--output", "none/graph.json"], "does not exist"),
    ],
)
def test_build_refuses_before_it_renders(arguments: list[str], complaint: str, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        assert complaint in str(error_of("build", *arguments))
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["build", "show", "plan", "convert", "plot"])
def test_every_option_has_a_help_text(command: str) -> None:
    for parameter in graph_group.commands[command].params:
        if parameter.param_type_name == "option":
            assert parameter.to_info_dict()["help"]
