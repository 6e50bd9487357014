"""Rooms are opened beside the learner's own work."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from hoz_dist.errors import InvalidValueError
from hoz_dist.nav.rooms import RoomId
from learner import rooms as module
from learner.rooms import RoomOpener, RoomSource
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
        opened.extend(views.room for views in rooms.opened())
        return len(opened) >= count

    until(all_there, "the rooms")
    return opened


def test_rooms_are_opened_once_and_those_that_are_missing_are_rendered_first() -> None:
    store, rendered = FakeStore(ONE), []

    def render(room: RoomId) -> None:
        rendered.append(room)
        store.held.add(room)

    with opener(store, render) as rooms:
        assert rooms.opened() == []
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
    assert caplog.text.count("cannot open the views of a room (The disk is full.); its rollouts wait") == 1
