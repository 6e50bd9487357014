import ast
import fcntl
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.sim import view_store
from tests.integration.seeing import KITCHEN, TinyEncoder, small_store

PACKAGE = Path(view_store.__file__).parents[1]
SIM = PACKAGE / "sim"
# Names and errors only; what a room holds is in its digest; the files' format has a version of its own.
HARMLESS = {PACKAGE / name for name in ("errors.py", "atomic.py", "nav/rooms.py", "sim/room.py", "sim/bullet.py")}
FORMAT = {SIM / "view_folder.py"}


class StopError(Exception):
    pass


def test_who_waits_for_another_process_can_be_stopped(tmp_path: Path) -> None:
    store = small_store(tmp_path)
    told: list[tuple[int, int]] = []

    def stop_at_the_second_call(done: int, total: int) -> None:
        told.append((done, total))
        if len(told) == 2:
            raise StopError

    with (tmp_path / f".{store._path(KITCHEN).name}.lock").open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(StopError):
            store.open(KITCHEN, TinyEncoder(), stop_at_the_second_call)
    assert told == [(0, 1)] * 2


def imported_from(path: Path) -> set[Path]:
    """Return the files of hoz_dist that a file imports, and that those import."""
    found: set[Path] = set()
    waiting = [path]
    while waiting:
        for node in ast.walk(ast.parse(waiting.pop().read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("hoz_dist."):
                file = PACKAGE.parent / (node.module.replace(".", "/") + ".py")
                if file not in found | HARMLESS | FORMAT:
                    found.add(file)
                    waiting.append(file)
    return found


def files(names: tuple[str, ...]) -> set[Path]:
    return {(SIM / name).resolve() for name in names}


def test_all_that_shapes_pictures_is_in_the_key() -> None:
    assert imported_from(SIM / "painter.py") | {SIM / "painter.py"} == files(view_store._PICTURE_SOURCES)


def test_all_that_shapes_derived_arrays_is_in_a_key() -> None:
    makers = {SIM / "detections.py", SIM / "appearance.py"}
    shaping = makers.union(*map(imported_from, makers))
    assert shaping <= files(view_store._DERIVED_SOURCES) | files(view_store._PICTURE_SOURCES)


def module_of(path: Path, text: str) -> ModuleType:
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_another_source_of_an_encoder_is_another_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = []
    for number in range(2):
        module = module_of(tmp_path / f"encoder_{number}.py", f"class Encoder:\n    key = 'same'\nSCALE = {number}\n")
        monkeypatch.setitem(sys.modules, module.__name__, module)
        encoder: VisualEncoder = module.Encoder()
        names.append(view_store._derived_name(encoder))
        assert view_store._derived_name(module.Encoder()) == names[-1]
    assert names[0] != names[1]


def test_an_encoder_without_a_source_is_known_by_its_key() -> None:
    class Typed(TinyEncoder):
        __module__ = "builtins"

    assert view_store._derived_name(Typed("a")) == view_store._derived_name(Typed("a"))
    assert view_store._derived_name(Typed("a")) != view_store._derived_name(Typed("b"))
