"""What an actor reports, with a learner, rooms and rollouts that only look like ones."""

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from hoz_dist.a3c.loss import Loss
from hoz_dist.config import RunConfig
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.message import MAX_EPISODES
from hoz_dist.wire.protocol.rejection import Reason
from tests.wire_samples import EPISODE
from workers import actor as module
from workers.actor import REPORT_EPISODES, REPORT_ROLLOUTS, Actor
from workers.collector import Update

LOSS = Loss(torch.zeros(()), policy=2.0, value=4.0, entropy=6.0, scene=8.0, approach=0.5)
STALE = Refused(Reason.STALE, "too old", 1)
FINITE = np.zeros(3, np.float32)
NOT_FINITE = np.array([0.0, np.nan, 0.0], np.float32)


class FakeLink:
    """A learner that gives the same answer to every gradient, and notes the reports."""

    def __init__(self, answer: Accepted | Refused) -> None:
        self.config = RunConfig(batch=1)
        self.epoch = 1
        self.reports: list[tuple[int, dict[str, float]]] = []
        self._answer = answer

    def parameters(self, *_: Any) -> Any:
        return SimpleNamespace(head=SimpleNamespace(epoch=1, version=0, stamp=(1, 0)), vector=FINITE)

    def scene_graphs(self) -> dict[str, Any]:
        return {}

    def push_room_graph(self, *_: Any) -> Accepted | Refused:
        return Accepted(1, 0)

    def push_gradient(self, *_: Any) -> Accepted | Refused:
        return self._answer

    def push_episodes(self, episodes: list[EpisodeResult], losses: dict[str, float]) -> Accepted | Refused:
        self.reports.append((len(episodes), losses))
        return Accepted(1, 0)


class FakeRollouts:
    """Ends the actor's work after some rollouts."""

    def __init__(self, stop: threading.Event, rollouts: int, gradient: Any, episodes: int) -> None:
        self._stop, self._left = stop, rollouts
        self._update = Update(gradient, 20, LOSS, [EPISODE] * episodes)

    def load(self, *_: Any) -> None:
        pass

    def roll_out(self) -> Update:
        self._left -= 1
        if not self._left:
            self._stop.set()
        return self._update


def reports(
    monkeypatch: pytest.MonkeyPatch,
    answer: Accepted | Refused,
    rollouts: int,
    gradient: Any = FINITE,
    episodes: int = 3,
) -> list[tuple[int, dict[str, float]]]:
    """Let an actor work, and return the number of episodes and the losses of its reports.

    Args:
        monkeypatch: Puts what only looks like rooms and rollouts in their places.
        answer: The learner's to every gradient.
        rollouts: How many the actor makes.
        gradient: Of every rollout.
        episodes: How many end in every rollout.
    """
    stop, link = threading.Event(), FakeLink(answer)
    room = SimpleNamespace(graph=None, views=SimpleNamespace(room="kitchen/1"))
    preparation = SimpleNamespace(waiting=0, next=lambda *_: room)
    monkeypatch.setattr(module, "RoomPreparation", lambda *_, **__: preparation)
    monkeypatch.setattr(module, "BatchEnv", lambda *_, **__: SimpleNamespace(add_room=lambda *_: None))
    monkeypatch.setattr(module, "Collector", lambda *_: FakeRollouts(stop, rollouts, gradient, episodes))
    nothing: Any = None
    Actor(link, [], nothing, nothing, nothing, "a0", stop).run()  # type: ignore[arg-type]
    return link.reports


def test_losses_are_means_over_the_accepted_gradients(monkeypatch: pytest.MonkeyPatch) -> None:
    losses = {"policy_loss": 2.0, "value_loss": 4.0, "entropy": 6.0, "scene_loss": 8.0, "approach_loss": 0.5}
    found = reports(monkeypatch, Accepted(1, 1), 2 * REPORT_ROLLOUTS)
    assert found == [(3 * REPORT_ROLLOUTS, losses)] * 2


def test_an_actor_whose_gradients_are_refused_reports_its_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    assert reports(monkeypatch, STALE, 2 * REPORT_ROLLOUTS) == [(3 * REPORT_ROLLOUTS, {})] * 2


def test_an_actor_whose_gradients_are_not_finite_reports_its_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    found = reports(monkeypatch, Accepted(1, 1), 2 * REPORT_ROLLOUTS, NOT_FINITE)
    assert found == [(3 * REPORT_ROLLOUTS, {})] * 2


def test_many_episodes_are_reported_before_they_fill_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    found = reports(monkeypatch, STALE, 4, episodes=REPORT_EPISODES - 1)
    assert [episodes for episodes, _ in found] == [2 * (REPORT_EPISODES - 1)] * 2
    assert 2 * (REPORT_EPISODES - 1) <= MAX_EPISODES
