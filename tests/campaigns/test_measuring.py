"""The campaigns' own measures: each finds what it is there to find."""

import json
import random
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.config import RunConfig
from learner.checkpoint import FOLDER, Checkpoint, save_checkpoint
from learner.deduplication import SeenPushes, Sender
from learner.optimizer import AdamState
from tests.campaigns.audit import audit
from tests.campaigns.faults import Fault, plan
from tests.campaigns.journals import Acknowledged, FrameRate
from tests.campaigns.windows import Leaders, Question, query_figures, windows_without_leader

ROUTER, LEARNERS = "router", ("a", "b")


def gradient(sequence: int, epoch: int, version: int) -> Acknowledged:
    return Acknowledged("anna", 0.0, "gradient", 7, sequence, epoch, version, 20)


def write_run(
    run: Path, epochs: Sequence[tuple[int, Sequence[int]]], seen: Sequence[int], kind: str = "gradient"
) -> None:
    """Write a run: of each epoch the version that it began from and the sequence numbers that it applied."""
    (run / "updates").mkdir(parents=True)
    for number, (version, sequences) in enumerate(epochs, start=1):
        lines: list[dict[str, object]] = [{"epoch": number, "from_version": version}]
        update = {"actor": "anna", "incarnation": 7, "version": 0, "lag": 0, "learning_rate": 0.1}
        lines += [update | {"sequence": sequence} for sequence in sequences]
        text = "".join(json.dumps(line) + "\n" for line in lines)
        (run / "updates" / f"epoch-{number:04d}.jsonl").write_text(text)
    table, vector = SeenPushes(), np.zeros(3, np.float32)
    for sequence in seen:
        table.add(Sender(kind, "anna", 7), sequence)
    version = epochs[-1][0] + len(epochs[-1][1])
    checkpoint = Checkpoint(
        config=RunConfig(),
        epoch=len(epochs),
        version=version,
        frames=20 * version,
        episodes=0,
        seconds=0.0,
        parameters=vector,
        adam=AdamState(version, vector, vector),
        rooms=(),
        graph_versions={},
        recent=(),
        seen=table.rows(),
    )
    save_checkpoint(run / FOLDER, checkpoint)


def test_the_audit_takes_what_a_killed_learner_lost_for_lost(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 1, 2]), (2, [3, 4])], seen=[0, 1, 3, 4])
    pushes = [gradient(0, 1, 1), gradient(1, 1, 2), gradient(2, 1, 3), gradient(3, 2, 3), gradient(4, 2, 4)]
    figures, record, lasting = audit(tmp_path, pushes)
    assert figures.problems == []
    assert (figures.epochs, figures.version, figures.lost_with_their_learner) == (2, 4, 1)
    assert record.total() == 4
    assert [push.sequence for push in lasting] == [0, 1, 3, 4]


def test_a_checkpoint_may_lack_episodes_that_were_reported_at_its_version(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 1]), (2, [2])], seen=[0, 1, 2])
    reports = [gradient(sequence, 1, version)._replace(kind="episodes") for sequence, version in ((0, 1), (1, 2))]
    figures, _, _ = audit(tmp_path, reports)
    assert figures.covered == {"episodes": 1}
    assert len(figures.problems) == 1
    assert "sequence=0" in figures.problems[0]


def test_the_audit_finds_an_acknowledged_gradient_that_is_not_in_the_record(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 2])], seen=[0, 1, 2])
    problems = audit(tmp_path, [gradient(0, 1, 1), gradient(1, 1, 2)]).figures.problems
    assert len(problems) == 1
    assert "counts 0 times" in problems[0]


@pytest.mark.parametrize(("frames", "problems"), [(20, 0), (30, 0), (19, 1)])
def test_rollouts_count_once_and_for_no_more_frames_than_they_have(tmp_path: Path, frames: int, problems: int) -> None:
    write_run(tmp_path, [(0, [0, 1]), (1, [2])], seen=[0, 2], kind="trajectory")
    pushes = [
        gradient(sequence, epoch, version)._replace(kind="trajectory", frames=frames)
        for sequence, epoch, version in ((0, 1, 1), (1, 1, 2), (2, 2, 2))
    ]
    figures, _, lasting = audit(tmp_path, pushes)
    assert [push.sequence for push in lasting] == [0, 2]
    assert figures.lost_with_their_learner == 1
    assert len(figures.problems) == problems
    assert FrameRate(pushes).between(-1.0, 1.0) == 1.5 * frames


def test_the_audit_finds_a_rollout_that_was_forgotten(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 2])], seen=[0], kind="trajectory")
    pushes = [gradient(sequence, 1, sequence + 1)._replace(kind="trajectory") for sequence in (0, 1)]
    assert len([problem for problem in audit(tmp_path, pushes).figures.problems if "counts 0 times" in problem]) == 1


def test_the_audit_finds_a_gradient_that_counts_twice(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 1]), (2, [1])], seen=[0, 1])
    problems = audit(tmp_path, [gradient(0, 1, 1), gradient(1, 1, 2)]).figures.problems
    assert any("is in the record 2 times" in problem for problem in problems)
    assert any("counts 2 times" in problem for problem in problems)


def test_the_audit_finds_a_push_that_the_checkpoint_forgot(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 1])], seen=[0])
    problems = audit(tmp_path, [gradient(0, 1, 1), gradient(1, 1, 2)]).figures.problems
    assert len(problems) == 1
    assert "lacks" in problems[0]


def test_the_audit_finds_updates_that_are_missing_from_the_record(tmp_path: Path) -> None:
    write_run(tmp_path, [(0, [0, 1])], seen=[0, 1])
    path = tmp_path / "updates" / "epoch-0001.jsonl"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    assert "the record has 1 updates" in audit(tmp_path, []).figures.problems[0]


def seen_by(*notes: tuple[float, str]) -> list[Leaders]:
    return [Leaders(time, frozenset((name, 1) for name in names)) for time, names in notes]


def test_a_killed_leader_is_away_until_another_token_is_seen() -> None:
    leaders = seen_by((0.0, "a"), (10.3, ""), (11.0, "b"))
    fault = Fault("a", "kill", 10.0, 10.0)
    windows = windows_without_leader(leaders, [fault], router=ROUTER, learners=LEARNERS, end=20.0)
    assert windows == [(10.0, 11.0, fault)]


def test_a_paused_leader_is_away_until_it_goes_on_or_another_leads() -> None:
    fault = Fault("a", "pause", 10.0, 16.0)
    alone = windows_without_leader(seen_by((0.0, "a")), [fault], router=ROUTER, learners=LEARNERS, end=20.0)
    assert alone == [(10.0, 16.0, fault)]
    leaders = seen_by((0.0, "a"), (12.0, ""), (14.0, "b"))
    taken_over = windows_without_leader(leaders, [fault], router=ROUTER, learners=LEARNERS, end=20.0)
    assert taken_over == [(10.0, 14.0, fault)]


def test_a_restarted_router_makes_the_leader_show_its_token_again() -> None:
    fault = Fault(ROUTER, "kill", 10.0, 10.0)
    leaders = seen_by((0.0, "a"), (10.05, ""), (12.0, "a"))
    windows = windows_without_leader(leaders, [fault], router=ROUTER, learners=LEARNERS, end=20.0)
    assert windows == [(10.0, 12.0, fault)]


def test_nothing_excuses_a_leader_that_is_away_without_a_fault_of_learner_or_router() -> None:
    leaders = seen_by((0.0, "a"), (10.0, ""), (12.0, "a"))
    fault = Fault("actor-0", "kill", 9.9, 9.9)
    windows = windows_without_leader(leaders, [fault], router=ROUTER, learners=LEARNERS, end=20.0)
    assert windows == [(10.0, 12.0, None)]
    questions = [Question(11.0, 2.0, answered=False), Question(13.0, 0.01, answered=True)]
    figures = query_figures(questions, windows)
    assert (figures.asked, figures.answered) == (2, 1)


def test_queries_within_an_excused_window_do_not_count() -> None:
    leaders, fault = seen_by((0.0, "a"), (10.0, ""), (12.0, "a")), Fault("a", "kill", 10.0, 10.0)
    windows = windows_without_leader(leaders, [fault], router=ROUTER, learners=LEARNERS, end=20.0)
    questions = [Question(sent, 0.02, answered=not 10.0 <= sent < 12.0) for sent in (9.0, 10.0, 11.9, 12.0, 13.0)]
    figures = query_figures(questions, windows)
    assert (figures.asked, figures.answered, figures.excused) == (3, 3, 2)


def rate_of(*stretches: tuple[float, float]) -> FrameRate:
    """Ten gradients a second in some stretches of time."""
    times = [time for begin, end in stretches for time in np.arange(begin, end, 0.1)]
    return FrameRate(Acknowledged("anna", time, "gradient", 1, 0, 1, 1, 100) for time in times)


def test_training_has_recovered_at_the_end_of_the_first_good_second() -> None:
    rate = rate_of((0.0, 20.0), (24.0, 60.0))
    assert rate.between(0.05, 10.05) == pytest.approx(1000.0)
    assert rate.recovery(20.0, 10.0, 30.0) == pytest.approx(4.8, abs=0.11)  # 80% of the second from 23.8 on


def test_a_good_second_that_does_not_last_is_no_recovery() -> None:
    rate = rate_of((0.0, 20.0), (20.0, 21.2), (26.0, 60.0))
    assert rate.recovery(20.0, 10.0, 30.0) == pytest.approx(6.8, abs=0.11)


def test_training_that_stays_away_has_not_recovered() -> None:
    assert rate_of((0.0, 20.0)).recovery(20.0, 10.0, 30.0) is None


def test_a_plan_has_all_its_faults_within_its_time_and_is_the_same_again() -> None:
    blows = plan(random.Random(3), ("a", "b"), 60.0, 40)
    assert len(blows) == 40
    assert all(0.0 <= blow.after <= 60.0 for blow in blows)
    assert {(blow.kind, blow.name) for blow in blows} == {(k, n) for k in ("kill", "pause") for n in ("a", "b")}
    assert blows == plan(random.Random(3), ("a", "b"), 60.0, 40)
