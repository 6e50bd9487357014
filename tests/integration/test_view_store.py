"""The view cache with real pictures: what it holds is right, survives damage, and is shared safely."""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from hoz_dist.errors import HozError
from hoz_dist.nav.categories import category_index
from hoz_dist.nav.pose import Pose
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.encoders.pooled import PooledEncoder
from hoz_dist.sim import view_store
from hoz_dist.sim.camera import Camera
from hoz_dist.sim.catalogue import load_room
from hoz_dist.sim.room_views import RoomViews
from hoz_dist.sim.view_store import ViewStore, default_cache
from hoz_dist.sim.world import World
from tests.integration.commands import SMALL_ROOMS
from tests.integration.seeing import KITCHEN, SIDE, TinyEncoder, small_rooms, small_store

pytestmark = pytest.mark.integration

FRIDGE, CHAIR = category_index("Fridge"), category_index("Chair")
ARRAYS = ("features", "detections", "appearance", "success", "optimal")


def assert_same(one: RoomViews, other: RoomViews) -> None:
    for name in ARRAYS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert np.array_equal(one.graph.transitions, other.graph.transitions)
    assert one.targets == other.targets


def folder_of(cache: Path) -> Path:
    return next(path for path in cache.iterdir() if path.is_dir())


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A complete cache; copy it before changing it."""
    folder = tmp_path_factory.mktemp("filled")
    small_store(folder).open(KITCHEN, TinyEncoder())
    return folder


@pytest.fixture(scope="module")
def whole(filled: Path) -> RoomViews:
    return small_store(filled).open(KITCHEN, TinyEncoder())


@pytest.fixture
def copied(filled: Path, tmp_path: Path) -> Path:
    """A complete cache that may be changed."""
    return Path(shutil.copytree(filled, tmp_path / "copied"))


def test_views_show_the_room_as_it_is(whole: RoomViews) -> None:
    """The fridge stands ahead of an agent that looks along +z; closer than 1.5 m is success."""
    far, near = (whole.graph.view_of(Pose(0.75, z, 0, 0)) for z in (0.5, 1.75))
    for view in (far, near):
        x0, _, x1, _, confidence = whole.detections[view, FRIDGE]
        assert confidence == 1.0
        assert x0 + x1 == pytest.approx(1.0, abs=2 / SIDE)
    assert not whole.success[far, FRIDGE]
    assert whole.success[near, FRIDGE]
    assert 0 < whole.optimal[far, FRIDGE] <= 5
    behind = whole.graph.view_of(Pose(0.75, 1.75, 180, 0))
    assert whole.detections[behind, FRIDGE].tolist() == [0.0] * 5
    assert not whole.success[behind, FRIDGE]
    assert whole.targets == (CHAIR, FRIDGE)
    assert whole.bag[near, FRIDGE]
    assert not whole.bag[behind, FRIDGE]


def test_targets_are_those_that_the_scene_asks_for(tmp_path: Path) -> None:
    living_room = small_store(tmp_path).open(RoomId("living_room", 1), TinyEncoder())
    assert living_room.targets == (CHAIR,)
    assert living_room.bag[:, FRIDGE].any()


def test_frames_are_the_cameras(tmp_path: Path) -> None:
    store = small_store(tmp_path)
    graph = store.graph(KITCHEN)
    chosen = np.array([40, 3, graph.views - 1, 3])
    frames = store.frames(KITCHEN, chosen)
    with World(small_rooms(KITCHEN)) as world:
        camera = Camera(world, SIDE)
        for row, view in enumerate(chosen.tolist()):
            rgb, depth, segmentation = camera.render(graph.pose(view))
            assert np.array_equal(frames.rgb[row], rgb)
            assert np.array_equal(frames.depth[row], depth.astype(np.float16))
            assert np.array_equal(frames.segmentation[row], segmentation)
    every = store.frames(KITCHEN)
    assert every.rgb.shape == (graph.views, SIDE, SIDE, 3)
    assert np.isfinite(every.depth).all()


def test_progress_runs_to_the_number_of_views_and_only_while_rendering(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []

    def told(done: int, total: int) -> None:
        calls.append((done, total))

    views = small_store(tmp_path).open(KITCHEN, TinyEncoder(), told)
    assert calls[-1] == (views.graph.views, views.graph.views)
    assert calls == sorted(calls)
    calls.clear()
    small_store(tmp_path).open(KITCHEN, TinyEncoder(), told)
    assert calls == []


def test_a_room_is_rendered_and_encoded_once(tmp_path: Path, whole: RoomViews) -> None:
    first, again, other = TinyEncoder(), TinyEncoder(), TinyEncoder("other/1")
    small_store(tmp_path).open(KITCHEN, first)
    written = {path: path.stat().st_mtime_ns for path in folder_of(tmp_path).glob("rgb.npy")}
    assert first.pictures == whole.graph.views
    assert_same(small_store(tmp_path).open(KITCHEN, again), whole)
    assert again.pictures == 0
    small_store(tmp_path).open(KITCHEN, other)
    assert other.pictures == whole.graph.views
    assert {path: path.stat().st_mtime_ns for path in written} == written
    small_store(tmp_path, side=SIDE * 2).frames(KITCHEN, np.array([0]))
    assert len([path for path in tmp_path.iterdir() if path.is_dir()]) == 2


def test_opening_a_complete_room_is_quick_and_needs_no_pybullet(filled: Path, whole: RoomViews) -> None:
    start = time.process_time()
    small_store(filled).open(KITCHEN, TinyEncoder())
    assert time.process_time() - start < 0.05
    code = (
        "import sys; from pathlib import Path; from tests.integration.seeing import *;"
        f"views = small_store(Path({str(filled)!r})).open(KITCHEN, TinyEncoder());"
        "assert 'pybullet' not in sys.modules; print(views.graph.views)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert (done.stderr, done.stdout.strip()) == ("", str(whole.graph.views))


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def overwrite(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[-100:] = b"damage" * 16 + b"dama"
    path.write_bytes(content)


def spoil_the_start(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[13] ^= 0x08
    path.write_bytes(content)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def delete(path: Path) -> None:
    path.unlink()


@pytest.mark.parametrize("harm", [truncate, overwrite, spoil_the_start, empty, delete])
@pytest.mark.parametrize(
    "pattern", ["header.json", "positions.npy", "checksums.npy", "rgb.npy", "tiny-1-*.json", "*.features.npy"]
)
def test_damage_is_mended(
    copied: Path, filled: Path, whole: RoomViews, harm: Callable[[Path], None], pattern: str
) -> None:
    (path,) = folder_of(copied).glob(pattern)
    harm(path)
    mended = small_store(copied)
    assert_same(mended.open(KITCHEN, TinyEncoder()), whole)
    expected = small_store(filled).frames(KITCHEN)._asdict()
    for name, array in mended.frames(KITCHEN)._asdict().items():
        assert np.array_equal(array, expected[name]), name


def test_a_damaged_picture_is_rendered_again_where_it_is(copied: Path, filled: Path) -> None:
    sound, damaged = (np.load(folder_of(cache) / "depth.npy", mmap_mode="r+") for cache in (filled, copied))
    damaged[20, 3, 3] = -1.0
    assert small_store(copied).frames(KITCHEN, np.array([20])).depth[0, 3, 3] == sound[20, 3, 3]
    assert np.array_equal(damaged, sound)


def test_two_processes_fill_one_room_at_once(tmp_path: Path, whole: RoomViews) -> None:
    code = (
        "from pathlib import Path; from tests.integration.seeing import *;"
        f"small_store(Path({str(tmp_path)!r})).open(KITCHEN, TinyEncoder())"
    )
    fillers = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(2)]
    assert [filler.wait(60) for filler in fillers] == [0, 0]
    untouched = TinyEncoder()
    assert_same(small_store(tmp_path).open(KITCHEN, untouched), whole)
    assert untouched.pictures == 0
    assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == [folder_of(tmp_path).name]


def test_a_filler_that_is_killed_leaves_a_cache_that_can_be_finished(tmp_path: Path, whole: RoomViews) -> None:
    code = (
        "import os; from pathlib import Path; from tests.integration.seeing import *;"
        f"small_store(Path({str(tmp_path)!r})).open("
        "KITCHEN, TinyEncoder(), lambda done, total: os.kill(os.getpid(), 9) if done > 100 else None)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, timeout=60, capture_output=True)
    assert done.returncode == -9
    filled = np.count_nonzero(np.load(folder_of(tmp_path) / "checksums.npy"))
    assert 0 < filled < len(whole.graph.positions)
    assert_same(small_store(tmp_path).open(KITCHEN, TinyEncoder()), whole)


def test_a_complete_cache_that_cannot_be_written_still_opens(copied: Path, whole: RoomViews) -> None:
    for path in copied.glob(".*.lock"):
        # A folder in the lock's place stands for a cache without write access, which root has everywhere.
        path.unlink()
        path.mkdir()
    store = small_store(copied)
    assert_same(store.open(KITCHEN, TinyEncoder()), whole)
    assert len(store.frames(KITCHEN).rgb) == whole.graph.views
    with pytest.raises(HozError, match="cannot be written"):
        store.open(KITCHEN, TinyEncoder("other/1"))


def test_a_cache_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(HozError, match=r"^The view cache .* cannot be written \(.*\); set HOZ_CACHE to .*\.$"):
        small_store(tmp_path / "file" / "cache").open(KITCHEN, TinyEncoder())


def test_the_default_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOZ_CACHE", str(tmp_path))
    assert default_cache() == tmp_path
    monkeypatch.delenv("HOZ_CACHE")
    assert default_cache().name == "hoz-dist"


def test_a_room_of_the_cache_opens_without_being_made_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room, encoder = RoomId.parse(SMALL_ROOMS[0]), PooledEncoder()
    made = ViewStore(cache, 16).open(room, encoder)

    def fail(asked: RoomId) -> NoReturn:
        raise AssertionError(asked)

    monkeypatch.setattr(view_store, "load_room", fail)
    opened = ViewStore(cache, 16).open(room, encoder)
    assert opened.digest == load_room(room).digest
    assert np.array_equal(opened.features, made.features)
