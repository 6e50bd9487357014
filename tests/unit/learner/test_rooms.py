"""Rooms are opened beside the learner's own work."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.catalogue import RoomDiffersError
from learner import rooms as module
from learner.events import RoomOpened, RoomUnusable
from learner.rooms import RoomOpener, RoomSource
from tests.unit.learner.making import room_graph
from tests.waiting import until

ONE, OTHER = RoomId("kitchen", 1), RoomId("kitchen", 2)


class FakeStore:
    """Holds some rooms from the beginning, and others once they are rendered."""

    def __init__(self, *held: RoomId) -> None:
        self.held = set(held)
        self.found: list[RoomId] = []

    def find(self, room: RoomId, *_: object) -> object | None:
        self.found.append(room)
        return SimpleNamespace(room=room) if room in self.held else None

    def open(self, room: RoomId, *_: object) -> object:
        assert room in self.held, "rendered before it is opened"
        return SimpleNamespace(room=room)


def opener(store: FakeStore, render: Callable[[RoomId], object]) -> RoomOpener:
    nothing: Any = None
    fake: Any = store
    return RoomOpener(RoomSource(fake, nothing, render))


def opened_by(rooms: RoomOpener, count: int) -> list[RoomId]:
    opened: list[RoomId] = []

    def all_there() -> bool:
        opened.extend(news.views.room for news in rooms.news() if isinstance(news, RoomOpened))
        return len(opened) >= count

    until(all_there, "the rooms")
    return opened


def test_rooms_are_opened_once_and_those_that_are_missing_are_rendered_first() -> None:
    store, rendered = FakeStore(ONE), []

    def render(room: RoomId) -> None:
        rendered.append(room)
        store.held.add(room)

    with opener(store, render) as rooms:
        assert rooms.news() == []
        for room in (ONE, OTHER, ONE, OTHER):
            rooms.want(room)
        assert opened_by(rooms, 2) == [ONE, OTHER]
        assert rendered == [OTHER]
        assert store.found == [ONE, OTHER]


def test_a_room_that_cannot_be_opened_is_said_and_tried_again(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "RETRY_S", 0.01)
    store, tries = FakeStore(), []

    def render(room: RoomId) -> None:
        tries.append(room)
        if len(tries) < 3:
            message = "The disk is full."
            raise InvalidValueError(message)
        store.held.add(room)

    with opener(store, render) as rooms:
        rooms.want(ONE)
        assert opened_by(rooms, 1) == [ONE]
    assert tries == [ONE] * 3
    assert caplog.text.count("cannot open the views of kitchen/1 (The disk is full.); its rollouts wait") == 1


@pytest.mark.parametrize("error", [InvalidValueError, RuntimeError])
def test_a_room_that_fails_holds_up_no_other(error: type[Exception], caplog: pytest.LogCaptureFixture) -> None:
    """Neither for the time until it is tried again, nor for good."""

    def render(room: RoomId) -> None:
        raise error(str(room))

    with opener(FakeStore(OTHER), render) as rooms:
        rooms.want(ONE)
        rooms.want(OTHER)
        assert opened_by(rooms, 1) == [OTHER]
    assert "cannot open the views of kitchen/1" in caplog.text


def test_a_room_that_is_made_otherwise_here_is_given_up(caplog: pytest.LogCaptureFixture) -> None:
    def render(room: RoomId) -> None:
        raise RoomDiffersError(str(room))

    news: list[object] = []

    def hear() -> bool:
        news.extend(rooms.news())
        return bool(news)

    with opener(FakeStore(), render) as rooms:
        rooms.want(ONE)
        until(hear, "the failure")
    assert news == [RoomUnusable(ONE, "kitchen/1")]
    assert "now or later" in caplog.text


def test_the_rooms_of_a_checkpoint_are_opened_before_its_run_is_led() -> None:
    checkpoint: Any = SimpleNamespace(rooms=(room_graph(str(OTHER)), room_graph(str(ONE))))
    with opener(FakeStore(ONE, OTHER), lambda _: None) as rooms:
        rooms.want_those_of(checkpoint)
        rooms.want_those_of(checkpoint)
        assert opened_by(rooms, 2) == [OTHER, ONE]
        assert rooms.news() == []
