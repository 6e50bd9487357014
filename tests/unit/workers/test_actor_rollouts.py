"""An actor of a run that learns from rollouts, with a learner that only looks like one."""

import threading
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hoz_dist.errors import HozError
from hoz_dist.nav.categories import SCENES
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.waiting import StoppedError
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.graphs import scene_graph_reply
from hoz_dist.wire.protocol.rejection import Reason
from hoz_dist.wire.protocol.trajectories import GraphUsed
from tests.unit.workers.making import CONFIG, KITCHEN, room_views, scene_graph
from workers import actor as module
from workers.actor import Actor

ROLLOUTS = replace(CONFIG, learn_from="rollouts")


class FakeLearner:
    """Notes what it is asked and sent, in order; every answer is one version further."""

    def __init__(self, stop: threading.Event, answers: list[Accepted | Refused], vector: Any) -> None:
        self.config, self.epoch = ROLLOUTS, 1
        self.version = 0
        self.asked: list[tuple[int, int] | None] = []
        self.pushed: list[tuple[int, int]] = []
        self.graphs: list[tuple[GraphUsed, ...]] = []
        self.scenes: list[set[str]] = []
        """Those that the steps of each rollout were guided by the graphs of."""
        self.reports: list[int] = []
        self._stop, self._answers, self._vector = stop, answers, vector
        self.served = {"kitchen": scene_graph_reply(scene_graph("kitchen", 0, version=3), 1)}
        self.restarts_after: int | None = None

    def parameters(self, at_least: tuple[int, int] | None) -> Any:
        self.asked.append(at_least)
        head = SimpleNamespace(epoch=self.epoch, version=self.version, stamp=(self.epoch, self.version))
        return SimpleNamespace(head=head, vector=self._vector)

    def scene_graphs(self) -> dict[str, Any]:
        return self.served

    def check_same_run(self) -> None:
        pass

    def push_room_graph(self, *_: Any) -> Accepted | Refused:
        return Accepted(1, self.version)

    def push_trajectory(
        self, steps: Any, rooms: Any, graphs: tuple[GraphUsed, ...], stamp: tuple[int, int]
    ) -> Accepted | Refused:
        if self._stop.is_set():
            raise StoppedError  # as a push does
        assert [used.room for used in rooms] == [KITCHEN]
        assert steps.action.shape == (ROLLOUTS.rollout_steps, ROLLOUTS.batch)
        self.pushed.append(stamp)
        self.graphs.append(graphs)
        self.scenes.append({SCENES[index] for index in np.unique(steps.scene)})
        if len(self.pushed) == self.restarts_after:
            # A learner that has forgotten the bedrooms.
            self.epoch += 1
            self.served = self.served | {"kitchen": scene_graph_reply(scene_graph("kitchen", 0), self.epoch)}
        if len(self.pushed) == len(self._answers):
            self._stop.set()
        answer = self._answers[len(self.pushed) - 1]
        self.version += isinstance(answer, Accepted)
        return answer

    def push_episodes(self, episodes: list[Any], losses: dict[str, float]) -> Accepted | Refused:
        assert losses == {}
        self.reports.append(len(episodes))
        return Accepted(1, self.version)


def work(
    monkeypatch: pytest.MonkeyPatch, *answers: Accepted | Refused, restarts_after: int | None = None
) -> FakeLearner:
    """Let an actor work until it has had all the answers; with a restart, of a learner that served two graphs."""
    stop = threading.Event()
    learner = FakeLearner(stop, list(answers), initial_parameters(ROLLOUTS.policy, 0))
    learner.restarts_after = restarts_after
    if restarts_after is not None:
        learner.served["bedroom"] = scene_graph_reply(scene_graph("bedroom", 1), 1)
    room = SimpleNamespace(graph=None, views=room_views(KITCHEN))
    monkeypatch.setattr(module, "RoomPreparation", lambda *_, **__: SimpleNamespace(waiting=0, next=lambda *_: room))
    nothing: Any = None
    Actor(learner, [], nothing, nothing, nothing, "a0", stop).run()  # type: ignore[arg-type]
    return learner


def accepted(count: int) -> list[Accepted | Refused]:
    return [Accepted(1, version + 1) for version in range(count)]


def test_each_rollout_is_acted_on_parameters_that_lack_one_rollout(monkeypatch: pytest.MonkeyPatch) -> None:
    learner = work(monkeypatch, *accepted(6))
    # The second is acted while the first is under way; each later one on what the one before the last made.
    assert learner.pushed == [(1, 0), (1, 0), (1, 1), (1, 2), (1, 3), (1, 4)]
    assert learner.asked[:4] == [None, None, (1, 1), (1, 2)]
    assert {(used.scene, used.epoch, used.version) for (used,) in learner.graphs} == {("kitchen", 1, 3)}


def test_graphs_that_were_not_used_are_not_named_and_those_of_a_learner_that_is_gone_not_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    learner = work(monkeypatch, *accepted(8), restarts_after=3)
    named = [{used.scene for used in graphs} for graphs in learner.graphs]
    assert named == learner.scenes
    assert {"bedroom"} < set().union(*named[:3])
    # What was acted before the actor heard of it goes on being of the old epoch, and is refused once.
    assert {(used.scene, used.epoch) for graphs in learner.graphs[4:] for used in graphs} == {("kitchen", 2)}


def test_finished_episodes_are_reported_along_with_rollouts(monkeypatch: pytest.MonkeyPatch) -> None:
    learner = work(monkeypatch, *accepted(2 * module.REPORT_ROLLOUTS + 1))
    assert len(learner.reports) == 2
    assert sum(learner.reports) > 20


def test_a_refusal_that_passes_is_followed_by_newer_parameters(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    learner = work(monkeypatch, Accepted(1, 1), Refused(Reason.STALE, "too old", 1), *accepted(2))
    assert len(learner.pushed) == 4
    assert "a rollout was refused (stale): too old" in caplog.text
    assert learner.asked.count(None) == 3


def test_other_refusals_end_the_actor(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(HozError, match=r"The learner refused a rollout \(digest\): changed."):
        work(monkeypatch, Accepted(1, 1), Refused(Reason.DIGEST, "changed", 1), *accepted(3))
    learner = work(monkeypatch, Accepted(1, 1), Refused(Reason.FINISHED, "over", 1), *accepted(3))
    assert len(learner.pushed) < 5, "the run is over, which is no failure"
