import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hoz_dist.cli.checks.simulator import check_damage
from hoz_dist.errors import DamagedFileError
from hoz_dist.nav.pose import VIEWS_PER_POSITION
from hoz_dist.sim.pose_graph import PoseGraph
from hoz_dist.sim.view_folder import DERIVED, Frames, ViewFolder

SIDE = 16
POSITIONS = 3
NAME = "kitchen-1-0123456789abcdef"
ARRAYS = ("positions", "transitions", "rgb", "depth", "segmentation", "checksums")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A folder with pictures and derived arrays."""
    views = POSITIONS * VIEWS_PER_POSITION
    graph = PoseGraph(
        np.arange(POSITIONS * 2, dtype=np.int16).reshape(POSITIONS, 2), np.zeros((views, 6), dtype=np.int32)
    )
    folder = ViewFolder.create(tmp_path / NAME, graph, SIDE)
    for position in range(POSITIONS):
        folder.write(position, pictures(position))
    folder.save_derived("tiny", {name: derived(number) for number, name in enumerate(DERIVED)})
    return folder.path


def pictures(seed: int) -> Frames:
    rng = np.random.default_rng(seed)
    frames = Frames.empty(VIEWS_PER_POSITION, SIDE)
    for array in frames:
        array[:] = rng.integers(0, 200, array.shape)
    return frames


def same(first: Frames, second: Frames) -> bool:
    pairs = zip(first._asdict().values(), second._asdict().values(), strict=True)
    return all(one.dtype == other.dtype and np.array_equal(one, other) for one, other in pairs)


def derived(seed: int) -> NDArray[np.float32]:
    return np.random.default_rng(seed).random((POSITIONS * VIEWS_PER_POSITION, 4)).astype(np.float32)


def change_header(file: Path, old: bytes, new: bytes) -> None:
    content = file.read_bytes()
    assert old in content[:128]
    assert len(old) == len(new)
    file.write_bytes(content.replace(old, new, 1))


def test_what_is_stored_comes_back(path: Path) -> None:
    folder = ViewFolder.open(path, SIDE)
    for position in range(POSITIONS):
        frames = folder.read(position)
        assert frames is not None
        assert same(frames, pictures(position))
    arrays = folder.load_derived("tiny")
    assert arrays is not None
    assert list(arrays) == list(DERIVED)
    assert all(np.array_equal(array, derived(number)) for number, array in enumerate(arrays.values()))


def test_a_folder_tells_the_size_of_its_pictures(path: Path) -> None:
    assert ViewFolder.open(path).read(0) is not None
    with pytest.raises(DamagedFileError):
        ViewFolder.open(path, SIDE + 1)


def sound(path: Path) -> bool:
    """Say whether all that a folder still gives out is right; it may lack anything."""
    try:
        folder = ViewFolder.open(path, SIDE)
    except DamagedFileError:
        return True
    for position in range(POSITIONS):
        frames = folder.read(position)
        if frames is not None and not same(frames, pictures(position)):
            return False
    arrays = folder.load_derived("tiny")
    return arrays is None or all(np.array_equal(array, derived(number)) for number, array in enumerate(arrays.values()))


@pytest.mark.parametrize("name", [*ARRAYS, "tiny.features"])
@pytest.mark.parametrize("flip", [0x01, 0x08, 0x20, 0x80])
def test_a_flipped_bit_in_an_arrays_header_never_does_worse_than_to_make_it_missing(
    path: Path, name: str, flip: int
) -> None:
    file = path / f"{name}.npy"
    content = file.read_bytes()
    header = 10 + int.from_bytes(content[8:10], "little")
    # Of the blanks that fill the header up, a few stand for all.
    for place in [*range(content.rindex(b"}", 0, header) + 4), header - 1]:
        with file.open("r+b") as opened:
            opened.seek(place)
            opened.write(bytes([content[place] ^ flip]))
        assert sound(path), place
        check_damage(path.parent)
        with file.open("r+b") as opened:
            opened.seek(place)
            opened.write(content[place : place + 1])
    assert ViewFolder.open(path, SIDE).load_derived("tiny") is not None


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("depth", b"<f2", b">f2"),
        ("depth", b"<f2", b"<i2"),
        ("rgb", b"|u1", b"|i1"),
        ("segmentation", b"|u1", b"|b1"),
        ("checksums", b"<u8", b">u8"),
        ("checksums", b"<u8", b"<f8"),
        ("rgb", b"False,", b"True ,"),
        ("depth", b"48", b"47"),
        ("checksums", b"(3,)", b"(2,)"),
        ("positions", b"<i2", b">i2"),
        ("transitions", b"<i4", b"<f4"),
    ],
)
def test_an_array_of_another_type_or_shape_is_damage(path: Path, name: str, old: bytes, new: bytes) -> None:
    assert check_damage(path.parent).state == "ok"
    change_header(path / f"{name}.npy", old, new)
    with pytest.raises(DamagedFileError):
        ViewFolder.open(path, SIDE)
    assert check_damage(path.parent).state == "warn"


@pytest.mark.parametrize("text", ["0", "null", "{}", "[]", '""', '"text"', "[" * 100_000, "{", ""])
def test_a_list_of_derived_arrays_that_is_none_counts_as_missing(path: Path, text: str) -> None:
    (path / "tiny.json").write_text(text)
    assert ViewFolder.open(path, SIDE).load_derived("tiny") is None


def drop(digests: dict[str, str]) -> None:
    del digests["optimal"]


def add(digests: dict[str, str]) -> None:
    digests["more"] = digests["optimal"]


def swap(digests: dict[str, str]) -> None:
    digests["optimal"] = digests["success"]


@pytest.mark.parametrize("change", [drop, add, swap])
def test_derived_arrays_are_those_that_are_listed(path: Path, change: Callable[[dict[str, str]], None]) -> None:
    digests = json.loads((path / "tiny.json").read_text())
    change(digests)
    (path / "tiny.json").write_text(json.dumps(digests))
    assert ViewFolder.open(path, SIDE).load_derived("tiny") is None


def test_what_a_killed_process_left_is_cleared_away_when_arrays_are_stored(path: Path) -> None:
    (path / ".1234.tmp").touch()
    before = {file.name for file in path.iterdir()} - {".1234.tmp"}
    ViewFolder.open(path, SIDE).save_derived("tiny", {name: derived(7) for name in DERIVED})
    assert {file.name for file in path.iterdir()} == before
