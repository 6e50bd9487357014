import fcntl
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hoz_dist.atomic import flush_to_disk
from learner import leadership as module
from learner.leadership import DeposedError, Leadership, claim, is_held, newest_epoch

HOLD = """
import sys
from pathlib import Path
from learner.leadership import claim
held = claim(Path(sys.argv[1]), 0)
print(held.epoch, flush=True)
sys.stdin.read()
"""
CLAIM_FIVE = """
import sys
from pathlib import Path
from learner.leadership import claim, newest_epoch
run, won = Path(sys.argv[1]), []
sys.stdin.readline()
while len(won) < 5:
    held = claim(run, newest_epoch(run))
    if held is not None:
        won.append(held.epoch)
        held.close()
print(*won)
"""


def claimed(run: Path, after: int) -> Leadership:
    leadership = claim(run, after)
    assert leadership is not None
    return leadership


@contextmanager
def process(script: str, run: Path) -> Iterator["subprocess.Popen[str]"]:
    with subprocess.Popen(
        [sys.executable, "-c", script, str(run)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        try:
            yield child
        finally:
            child.kill()


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def test_epochs_are_claimed_one_after_the_other(tmp_path: Path) -> None:
    assert newest_epoch(tmp_path) == 0
    for epoch in (1, 2, 3):
        with claimed(tmp_path, epoch - 1) as leadership:
            assert leadership.epoch == newest_epoch(tmp_path) == epoch
            assert text(tmp_path / "epoch") == f"{epoch}\n"
            assert is_held(tmp_path, epoch)
            assert not leadership.deposed
        assert not is_held(tmp_path, epoch)
    assert {path.name for path in (tmp_path / "epochs").iterdir()} == {"0001", "0002", "0003"}


def test_an_epoch_is_claimed_once(tmp_path: Path) -> None:
    with claimed(tmp_path, 0) as first:
        assert claim(tmp_path, 0) is None
        assert not first.deposed
        assert is_held(tmp_path, 1)
    assert claim(tmp_path, 0) is None
    assert {path.name for path in (tmp_path / "epochs").iterdir()} == {"0001"}


def test_of_many_threads_that_claim_at_once_one_leads(tmp_path: Path) -> None:
    barrier = threading.Barrier(8)
    won: list[Leadership] = []

    def work() -> None:
        barrier.wait()
        leadership = claim(tmp_path, 0)
        if leadership is not None:
            won.append(leadership)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [leadership.epoch for leadership in won] == [1]
    assert not won[0].deposed
    won[0].close()


def test_processes_that_claim_again_and_again_never_get_the_same_epoch(tmp_path: Path) -> None:
    with process(CLAIM_FIVE, tmp_path) as one, process(CLAIM_FIVE, tmp_path) as other:
        claims = [child.communicate("go\n", timeout=30)[0].split() for child in (one, other)]
    epochs = sorted(int(epoch) for claims_of_one in claims for epoch in claims_of_one)
    assert epochs == list(range(1, 11))


def test_a_killed_leader_lets_go_and_one_that_stands_still_does_not(tmp_path: Path) -> None:
    with process(HOLD, tmp_path) as leader:
        assert leader.stdout is not None
        assert leader.stdout.readline() == "1\n"
        assert is_held(tmp_path, 1)
        leader.send_signal(signal.SIGSTOP)
        assert is_held(tmp_path, 1)
        with claimed(tmp_path, 1) as successor:  # it is not waited for
            assert successor.epoch == 2
        leader.send_signal(signal.SIGKILL)
        leader.wait(10)
        assert not is_held(tmp_path, 1)


def test_who_looks_at_a_lock_is_not_taken_for_the_leader(tmp_path: Path) -> None:
    claimed(tmp_path, 0).close()
    with (tmp_path / "epochs" / "0001" / "leader.lock").open() as file:
        fcntl.flock(file, fcntl.LOCK_SH)  # another one that looks
        assert not is_held(tmp_path, 1)


def test_a_deposed_leader_can_change_nothing(tmp_path: Path) -> None:
    file, other = tmp_path / "file", tmp_path / "other"
    with claimed(tmp_path, 0) as old:
        old.replace(file, lambda temporary: temporary.write_text("old"))
        with claimed(tmp_path, 1) as new:
            assert old.deposed
            for path in (file, other):
                with pytest.raises(DeposedError, match="Another learner leads"):
                    old.replace(path, lambda temporary: temporary.write_text("too late"))
            with pytest.raises(DeposedError):
                old.remove(file)
            assert text(file) == "old"
            assert not other.exists()
            new.replace(file, lambda temporary: temporary.write_text("new"))
            assert text(file) == "new"
            new.remove(file)
            assert not file.exists()


def test_what_a_leader_had_half_written_when_it_was_deposed_never_appears(tmp_path: Path) -> None:
    file = tmp_path / "file"
    with claimed(tmp_path, 0) as old:

        def deposed_meanwhile(temporary: Path) -> None:
            temporary.write_text("late")
            claimed(tmp_path, 1).close()
            assert not temporary.exists()

        with pytest.raises(DeposedError):
            old.replace(file, deposed_meanwhile)
    assert not file.exists()
    assert not any(path.is_file() and path.name != "leader.lock" for path in (tmp_path / "epochs").rglob("*"))


def test_what_was_in_place_before_the_claim_is_there_after_it(tmp_path: Path) -> None:
    """Many commits race a claim: each either is found by the claimer, or failed."""
    for epoch in range(1, 9):
        committed: list[int] = []
        started = threading.Event()

        def commit(leader: Leadership, committed: list[int] = committed, started: threading.Event = started) -> None:
            try:
                for number in range(10_000):
                    path = tmp_path / f"{leader.epoch}-{number}"
                    leader.replace(path, lambda temporary: temporary.touch())
                    committed.append(number)
                    started.set()
            except DeposedError:
                pass

        with claimed(tmp_path, 2 * epoch - 2) as leader:
            thread = threading.Thread(target=commit, args=(leader,))
            thread.start()
            started.wait()
            with claimed(tmp_path, 2 * epoch - 1):
                found = {path.name for path in tmp_path.glob(f"{leader.epoch}-*")}
                thread.join()
                assert {path.name for path in tmp_path.glob(f"{leader.epoch}-*")} == found
                # All that the old leader believes to have committed is among what the new one found.
                assert {f"{leader.epoch}-{number}" for number in committed} <= found


def test_a_claimer_that_was_stopped_in_the_midst_of_it_harms_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    successors: list[Leadership] = []

    def stopped_meanwhile(path: Path) -> None:
        monkeypatch.setattr("learner.leadership.flush_to_disk", flush_to_disk)
        flush_to_disk(path)
        successors.append(claimed(tmp_path, newest_epoch(tmp_path)))

    with claimed(tmp_path, 0) as first:
        monkeypatch.setattr("learner.leadership.flush_to_disk", stopped_meanwhile)
        assert claim(tmp_path, 1) is None
        assert first.deposed
    assert successors[0].epoch == 3
    assert not successors[0].deposed
    assert text(tmp_path / "epoch") == "3\n"
    successors[0].replace(tmp_path / "file", lambda temporary: temporary.touch())
    assert not is_held(tmp_path, 2)
    successors[0].close()


def test_a_claimer_that_wakes_up_late_does_not_hide_the_newest_epoch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fence = module._fence
    with claimed(tmp_path, 0) as late:

        def late_is_faster(folder: Path) -> None:
            late.replace(tmp_path / "epoch", lambda temporary: temporary.write_text("1\n"))
            fence(folder)

        monkeypatch.setattr("learner.leadership._fence", late_is_faster)
        with claimed(tmp_path, 1) as newest:
            assert text(tmp_path / "epoch") == "2\n"
            assert late.deposed
            assert not newest.deposed


def test_a_claimer_that_is_killed_in_the_midst_of_it_has_deposed_the_leader_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    with claimed(tmp_path, 0) as old:
        with monkeypatch.context() as patched:
            patched.setattr(Leadership, "replace", killed)
            with pytest.raises(KeyboardInterrupt):
                claim(tmp_path, 1)
        assert text(tmp_path / "epoch") == "1\n"
        assert old.deposed
        with claimed(tmp_path, newest_epoch(tmp_path)) as new:
            assert new.epoch == 3


def test_a_claim_takes_no_longer_after_many_epochs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for after in range(20):
        claimed(tmp_path, after).close()
    fenced: list[str] = []
    fence = module._fence

    def counted(folder: Path) -> None:
        fenced.append(folder.name)
        fence(folder)

    monkeypatch.setattr("learner.leadership._fence", counted)
    claimed(tmp_path, 20).close()
    assert fenced == ["0020"]


def test_what_a_claimer_that_was_killed_did_not_fence_the_next_one_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(_: Path) -> None:
        raise KeyboardInterrupt

    with claimed(tmp_path, 0) as old:
        with monkeypatch.context() as patched:
            patched.setattr("learner.leadership._fence", killed)
            for after in (1, 2, 3):
                with pytest.raises(KeyboardInterrupt):
                    claim(tmp_path, after)
        assert not old.deposed
        with claimed(tmp_path, 4) as new:
            assert old.deposed
            assert not new.deposed
        assert not list((tmp_path / "epochs").glob("000[1-4]/writing"))


def test_a_claimer_that_was_stopped_before_an_epoch_that_was_left_out_does_not_lead(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Checkpoints of epoch 7 were copied into the folder meanwhile, and another learner went on from them."""
    successors: list[Leadership] = []
    rename = Path.rename

    def stopped_before(path: Path, target: Path) -> Path:
        monkeypatch.setattr(Path, "rename", rename)
        successors.append(claimed(tmp_path, 7))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", stopped_before)
    assert claim(tmp_path, 1) is None
    assert not is_held(tmp_path, 2)
    assert text(tmp_path / "epoch") == "8\n"
    assert not successors[0].deposed
    successors[0].close()


def test_a_claim_on_a_folder_that_cannot_be_written_leaves_no_lock(tmp_path: Path) -> None:
    (tmp_path / "epochs").write_text("a file")
    with pytest.raises(OSError, match="epochs"):
        claim(tmp_path, 0)


@pytest.mark.parametrize("content", ["", "two", "\xff"])
def test_a_leader_whose_epoch_file_was_spoilt_leads_on_until_it_is_fenced(tmp_path: Path, content: str) -> None:
    with claimed(tmp_path, 0) as old:
        (tmp_path / "epoch").write_text(content, encoding="latin-1")
        assert not old.deposed
        claimed(tmp_path, 1).close()
        (tmp_path / "epoch").write_text(content, encoding="latin-1")
        assert old.deposed
