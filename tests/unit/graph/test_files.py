import json
import stat
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from hoz_dist.errors import DamagedFileError, InvalidValueError, NotFoundError
from hoz_dist.graph.files import FORMATS, Format, decode_graph, encode_graph, load_graph, save_graph
from hoz_dist.graph.plain import to_plain
from hoz_dist.graph.scene_graph import SceneGraph
from tests.unit.graph.samples import random_scene_graph

formats = pytest.mark.parametrize("extension", FORMATS)


def assert_same_arrays(first: SceneGraph, second: SceneGraph) -> None:
    np.testing.assert_array_equal(first.nodes, second.nodes)
    np.testing.assert_array_equal(first.edges, second.edges)


@formats
def test_graph_survives_a_file(extension: str, tmp_path: Path) -> None:
    graph = random_scene_graph()
    save_graph(graph, tmp_path / f"kitchen{extension}")
    loaded = load_graph(tmp_path / f"kitchen{extension}")
    assert_same_arrays(graph, loaded)
    assert loaded.scene == "kitchen"
    assert loaded.categories == graph.categories
    if extension != ".mat":
        assert (loaded.version, loaded.rooms) == (graph.version, graph.rooms)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 64), st.sampled_from(["json", "msgpack", "mat"]))
def test_every_bit_survives(seed: int, zones: int, file_format: Format) -> None:
    graph = random_scene_graph(seed, zones)
    assert_same_arrays(graph, decode_graph(encode_graph(graph, file_format), file_format, "kitchen"))


def test_mat_to_json_to_mat_gives_the_same_arrays(tmp_path: Path) -> None:
    graph = random_scene_graph()
    tables = {"node_features": graph.nodes, "edges": graph.edges}
    savemat(tmp_path / "Kitchens.mat", tables)
    save_graph(load_graph(tmp_path / "Kitchens.mat"), tmp_path / "graph.json")
    save_graph(load_graph(tmp_path / "graph.json"), tmp_path / "back.mat")
    back = loadmat(str(tmp_path / "back.mat"))
    for name, table in tables.items():
        np.testing.assert_array_equal(back[name], table)
        assert back[name].dtype == np.float64


def test_json_has_the_fields_that_scripts_rely_on() -> None:
    graph = random_scene_graph()
    values = json.loads(encode_graph(graph, "json"))
    assert list(values) == ["scene", "version", "rooms", "categories", "nodes", "edges"]
    assert np.shape(values["nodes"]) == (8, 22)
    assert np.shape(values["edges"]) == (8, 8)


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("Kitchens", "kitchen"),
        ("Living_Rooms", "living_room"),
        ("LivingRooms", "living_room"),
        ("bathroom", "bathroom"),
        ("my graph", "my graph"),
    ],
)
def test_scene_of_a_mat_file_is_guessed_from_its_name(name: str, scene: str, tmp_path: Path) -> None:
    save_graph(random_scene_graph(), tmp_path / f"{name}.mat")
    assert load_graph(tmp_path / f"{name}.mat").scene == scene
    assert load_graph(tmp_path / f"{name}.mat", "bedroom").scene == "bedroom"


def test_existing_file_is_kept_unless_told(tmp_path: Path) -> None:
    path = tmp_path / "graph.json"
    path.write_text("mine")
    with pytest.raises(InvalidValueError, match=r"exists already.*--force"):
        save_graph(random_scene_graph(), path)
    assert path.read_text() == "mine"
    save_graph(random_scene_graph(), path, overwrite=True)
    assert load_graph(path).zones == 8
    assert list(tmp_path.iterdir()) == [path]


def test_written_file_has_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "usual").touch()
    save_graph(random_scene_graph(), tmp_path / "graph.json")
    modes = {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("usual", "graph.json")}
    assert len(modes) == 1


def test_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"folder .* does not exist"):
        save_graph(random_scene_graph(), tmp_path / "none" / "graph.json")
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(InvalidValueError, match="is a folder"):
        save_graph(random_scene_graph(), tmp_path / "folder.json", overwrite=True)
    with pytest.raises(InvalidValueError, match=r"must end in .json, .msgpack, .mat"):
        save_graph(random_scene_graph(), tmp_path / "graph.txt")
    with pytest.raises(InvalidValueError, match="Cannot write"):
        save_graph(random_scene_graph(), tmp_path / f"{'long' * 100}.json")


def test_graph_of_other_categories_does_not_fit_a_mat_file(tmp_path: Path) -> None:
    graph = SceneGraph("kitchen", 0, (), ("Sink",), np.ones((1, 1)), np.eye(1))
    with pytest.raises(InvalidValueError, match="22 targets"):
        save_graph(graph, tmp_path / "graph.mat")


def test_file_that_cannot_be_found_or_is_a_folder(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no graph file"):
        load_graph(tmp_path / "none.json")
    with pytest.raises(DamagedFileError, match="is a folder"):
        load_graph(tmp_path)
    (tmp_path / "graph.txt").touch()
    with pytest.raises(InvalidValueError, match="Cannot tell the format"):
        load_graph(tmp_path / "graph.txt")


@formats
@pytest.mark.parametrize("content", [b"", b"\0", b"hello", b"\x80\x04N.", b"[" * 100_000, b"0" * (5 * 1024 * 1024)])
def test_file_of_another_kind_is_refused_in_one_sentence(extension: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"graph{extension}"
    path.write_bytes(content)
    with pytest.raises(DamagedFileError) as refusal:
        load_graph(path)
    message = str(refusal.value)
    assert message.startswith(f"'{path}' is not a graph file, or it is damaged: ")
    assert message.endswith(".")
    assert "\n" not in message


@formats
def test_truncated_file_is_refused(extension: str, tmp_path: Path) -> None:
    content = encode_graph(random_scene_graph(), FORMATS[extension])
    path = tmp_path / f"graph{extension}"
    for length in range(0, len(content) - 1, max(1, len(content) // 60)):
        path.write_bytes(content[:length])
        with pytest.raises(DamagedFileError):
            load_graph(path)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(["json", "msgpack", "mat"]), st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255))))
def test_changed_bytes_never_do_worse_than_an_error(file_format: Format, changes: list[tuple[int, int]]) -> None:
    content = bytearray(encode_graph(random_scene_graph(), file_format))
    for place, value in changes:
        content[place % len(content)] = value
    try:
        graph = decode_graph(bytes(content), file_format, "kitchen")
    except InvalidValueError:
        return
    assert np.isfinite(graph.nodes).all()


@pytest.mark.parametrize(
    ("field", "value", "complaint"),
    [
        ("scene", 3, "in 'scene' there must be printable names"),
        ("scene", "", "in 'scene'"),
        ("scene", "a\nb", "in 'scene'"),
        ("version", 1.5, "version must be an integer"),
        ("version", True, "version must be an integer"),
        ("version", -1, "version of a scene graph must not be negative"),
        ("rooms", "kitchen/1", "in 'rooms'"),
        ("rooms", [1], "in 'rooms'"),
        ("categories", ["Sink"], "8 zones by 1 categories"),
        ("categories", ["Sink"] * 22, "categories must differ"),
        ("nodes", [[0.5] * 22] * 7, "nodes must be a table of 8 zones"),
        ("nodes", [[0.5] * 21] * 8, "nodes must be a table of 8 zones by 22"),
        ("nodes", [[0.5] * 22] * 7 + [[0.5] * 21], "rows of numbers"),
        ("nodes", [[1.5] * 22] * 8, "nodes must be finite numbers from 0 to 1"),
        ("nodes", [[float("nan")] * 22] * 8, "nodes must be finite"),
        ("nodes", [["0.5"] * 22] * 8, "rows of numbers"),
        ("nodes", [[True] * 22] * 8, "rows of numbers"),
        ("nodes", [[None] * 22] * 8, "rows of numbers"),
        ("nodes", 0.5, "rows of numbers"),
        ("nodes", [], "nodes must be a table"),
        ("edges", [[1.0] * 8] * 7, "edges must be a square table"),
        ("edges", [[-0.1] * 8] * 8, "edges must be finite numbers from 0 to 1"),
        ("edges", [[0.5] * 8] * 8, "edges must be 1 on the diagonal"),
        ("edges", np.eye(65).tolist(), "1 to 64 zones"),
        ("edges", [], "edges must be a square table"),
    ],
)
@pytest.mark.parametrize("extension", [".json", ".msgpack"])
def test_wrong_field_is_named(extension: str, field: str, value: Any, complaint: str, tmp_path: Path) -> None:
    values = to_plain(random_scene_graph()) | {field: value}
    path = tmp_path / f"graph{extension}"
    path.write_bytes(json.dumps(values).encode() if extension == ".json" else msgpack.packb(values))
    with pytest.raises(DamagedFileError, match=complaint):
        load_graph(path)


@pytest.mark.parametrize("change", ["missing", "unknown"])
def test_missing_and_unknown_fields_are_refused(change: str, tmp_path: Path) -> None:
    values = to_plain(random_scene_graph())
    if change == "missing":
        del values["edges"]
    else:
        values["more"] = 1
    (tmp_path / "graph.json").write_text(json.dumps(values))
    with pytest.raises(DamagedFileError, match="must have the fields scene, version"):
        load_graph(tmp_path / "graph.json")


def test_file_that_is_too_large_is_refused(tmp_path: Path) -> None:
    content = encode_graph(random_scene_graph(), "json")
    (tmp_path / "graph.json").write_bytes(content + b" " * (4 * 1024 * 1024))
    with pytest.raises(DamagedFileError, match="larger than 4 MiB"):
        load_graph(tmp_path / "graph.json")


def test_number_too_large_for_a_double_is_refused(tmp_path: Path) -> None:
    values = to_plain(random_scene_graph())
    values["nodes"][0][0] = 10**400
    (tmp_path / "graph.json").write_text(json.dumps(values))
    with pytest.raises(DamagedFileError, match="a number is too large"):
        load_graph(tmp_path / "graph.json")


@pytest.mark.parametrize(
    ("tables", "complaint"),
    [
        ({"node_features": np.zeros((8, 22))}, "must hold the tables"),
        ({"node_features": np.zeros((8, 21)), "edges": np.eye(8)}, "8 zones by 22 categories"),
        ({"node_features": np.zeros((7, 22)), "edges": np.eye(8)}, "8 zones by 22 categories"),
        ({"node_features": np.full((8, 22), np.inf), "edges": np.eye(8)}, "must be finite"),
        ({"node_features": np.zeros((8, 22)), "edges": np.zeros((8, 8))}, "1 on the diagonal"),
        ({"node_features": np.zeros((8, 22)) + 1j, "edges": np.eye(8)}, "of real doubles"),
        ({"node_features": np.zeros((8, 22), dtype=np.uint8), "edges": np.eye(8)}, "of real doubles"),
        ({"node_features": "text", "edges": np.eye(8)}, "of real doubles"),
        ({"node_features": np.zeros((2000, 22)), "edges": np.eye(8)}, "8 zones by 22 categories"),
    ],
)
def test_mat_file_without_a_graph_is_refused(tables: dict[str, Any], complaint: str, tmp_path: Path) -> None:
    savemat(tmp_path / "Kitchens.mat", tables)
    with pytest.raises(DamagedFileError, match=complaint):
        load_graph(tmp_path / "Kitchens.mat")
