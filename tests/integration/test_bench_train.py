"""`hoz-dist bench train` with one actor and windows so short that its figures say nothing."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.integration.commands import SMALL_ROOMS, HozDist, children_of, hoz_dist
from tests.waiting import until

pytestmark = pytest.mark.integration


@pytest.fixture
def words(cache: Path) -> list[str]:
    options = ["--picture-size", "16", "--cache", str(cache), "--seconds", "0.01"]
    return ["bench", "train", "--actors", "1", "--scene", SMALL_ROOMS[0], *options]


@pytest.fixture
def bench(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[HozDist]:
    """The benchmark, as it runs; what it leaves behind is killed."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with HozDist(*words, log=tmp_path / "log") as bench:
        yield bench
    for child in children_of(bench.process.pid):
        os.kill(child, signal.SIGKILL)


def loops_of(bench: HozDist, folder: Path) -> list[int]:
    """Return the processes that train without Zenoh, once one of them is ready to."""
    if not any(folder.glob("hoz-dist-*/alone-0.jsonl")):
        return []  # what it has started so far renders rooms
    pid = bench.process.pid
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def actors_of(bench: HozDist) -> list[int]:
    children = children_of(bench.process.pid)
    return [child for child in children if b"\0actor\0" in Path(f"/proc/{child}/cmdline").read_bytes()]


def stands_still(process: int) -> bool:
    return Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2].startswith("T")


def test_a_run_and_its_loop_are_measured(words: list[str]) -> None:
    done = hoz_dist(*words)
    assert done.returncode == 0, done.stderr
    figures = {line.split()[1]: line for line in done.stdout.splitlines() if line.startswith("│")}
    assert {"frames_per_second", "share_of_in_process", "actor_act_ms", "learner_apply_ms"} <= set(figures)
    assert "frames/s" in figures["frames_per_second"]
    assert "bottleneck: " in done.stdout


def test_a_loop_that_is_killed_is_told_of(bench: HozDist, tmp_path: Path) -> None:
    until(lambda: not bench.runs or bool(loops_of(bench, tmp_path)), "the loop")
    os.kill(loops_of(bench, tmp_path)[0], signal.SIGKILL)
    assert bench.wait() == 2
    assert "hoz-dist: A process of the benchmark ended with exit status -9" in bench.said
    assert children_of(bench.process.pid) == []


def test_an_interrupted_benchmark_ends_actors_that_stand_still(bench: HozDist) -> None:
    until(lambda: not bench.runs or any(map(stands_still, actors_of(bench))), "an actor that stands still")
    assert bench.stop(signal.SIGINT) == 130, bench.said
    assert "Traceback" not in bench.said
    assert children_of(bench.process.pid) == []


def test_a_killed_benchmark_leaves_no_actor_that_has_just_started(bench: HozDist) -> None:
    until(lambda: not bench.runs or bool(actors_of(bench)), "an actor")
    assert bench.stop(signal.SIGKILL) == -signal.SIGKILL, bench.said
    until(lambda: children_of(bench.process.pid) == [], "the end of the children")
