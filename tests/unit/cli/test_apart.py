"""Work in other processes; what they do is at the top, where they find it."""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from threading import Event, Thread

import pytest

from hoz_dist.cli.apart import companion, work_apart
from hoz_dist.errors import HozError, NotFoundError
from tests.waiting import until


def add_up(numbers: list[int], progress: Callable[[float, float, str], None]) -> tuple[int, str]:
    progress(1, 2, "half of it")
    return sum(numbers), os.environ["OMP_WAIT_POLICY"]


def fail(progress: Callable[[float, float, str], None]) -> None:
    del progress
    raise NotFoundError("There is nothing here.")  # noqa: EM101, TRY003 - a sentence that the test looks for


def die(progress: Callable[[float, float, str], None]) -> None:
    del progress
    os._exit(7)


def serve(begun: Path, ended: Path, ready: Callable[[], None], stopped: Callable[[float], bool]) -> None:
    begun.touch()
    ready()
    while not stopped(10.0):
        pass
    ended.touch()


def serve_and_fail(ready: Callable[[], None], stopped: Callable[[float], bool]) -> None:
    ready()
    stopped(60.0)
    raise NotFoundError("There is nothing here.")  # noqa: EM101, TRY003 - a sentence that the test looks for


def serve_and_die(ready: Callable[[], None], stopped: Callable[[float], bool]) -> None:
    del stopped
    ready()
    os._exit(7)


def test_work_gets_the_environment_of_actors_and_gives_its_result(capsys: pytest.CaptureFixture[str]) -> None:
    assert work_apart("Adding", partial(add_up, [1, 2, 3])) == (6, "PASSIVE")
    assert "OMP_WAIT_POLICY" not in os.environ
    assert "50%  half of it" in capsys.readouterr().err


@pytest.mark.parametrize(("work", "said"), [(fail, r"There is nothing here\."), (die, "exit status 7")])
def test_work_that_fails_says_so_in_a_sentence(work: Callable[..., None], said: str) -> None:
    with pytest.raises(HozError, match=said):
        work_apart("Working", work)


def test_a_companion_serves_until_it_is_told_to_stop(tmp_path: Path) -> None:
    begun, ended = tmp_path / "begun", tmp_path / "ended"
    with companion(partial(serve, begun, ended)):
        assert begun.exists()
        assert not ended.exists()
    assert ended.exists()


def note_cores(path: Path, ready: Callable[[], None], stopped: Callable[[float], bool]) -> None:
    """Note the cores of each of two threads, again and again."""
    done = Event()
    thread = Thread(target=done.wait)
    thread.start()
    ready()
    while not stopped(0.01):
        tasks = [task.name for task in Path("/proc/self/task").iterdir()]
        cores = [os.sched_getaffinity(int(task)) for task in tasks]
        path.with_suffix(".new").write_text(repr(cores))
        path.with_suffix(".new").replace(path)
    done.set()
    thread.join()


def is_noted(path: Path, what: object) -> bool:
    return path.exists() and path.read_text() == repr(what)


def test_all_threads_of_a_companion_run_where_they_are_told_to(tmp_path: Path) -> None:
    mine, path = os.sched_getaffinity(0), tmp_path / "cores"
    with companion(partial(note_cores, path)) as served:
        for cores in ({max(mine)}, mine):
            served.run_on(cores)
            until(partial(is_noted, path, [cores, cores]), "the cores")


def test_a_companion_that_fails_says_so_at_the_end() -> None:
    with pytest.raises(HozError, match=r"There is nothing here\."), companion(serve_and_fail) as served:
        served.check()


def look_until_it_ends(serve: Callable[..., None]) -> None:
    with companion(serve) as served:
        while True:
            served.check()


def interrupt_while_it_stands_still(serve: Callable[..., None]) -> None:
    with companion(serve) as served:
        served.pause()
        raise KeyboardInterrupt


def test_a_companion_that_has_ended_is_found_out_when_looked_at() -> None:
    with pytest.raises(HozError, match="exit status 7"):
        look_until_it_ends(serve_and_die)


def test_a_companion_that_stands_still_is_ended_all_the_same(tmp_path: Path) -> None:
    begun, ended = tmp_path / "begun", tmp_path / "ended"
    with companion(partial(serve, begun, ended)) as served:
        served.pause()
    assert ended.exists()
    with pytest.raises(KeyboardInterrupt):
        interrupt_while_it_stands_still(partial(serve, begun, ended))
