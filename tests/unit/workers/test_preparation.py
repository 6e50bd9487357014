from pathlib import Path

import pytest

from hoz_dist.nav.rooms import RoomId, rooms_of
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.sim.view_store import ViewStore
from hoz_dist.waiting import StoppedError
from workers.preparation import RoomPreparation

ROOM = RoomId("bathroom", 9)
PICTURE_SIZE = 16
"""Small pictures render fast."""


def preparation(cache: Path, actor: str, *rooms: RoomId) -> RoomPreparation:
    return RoomPreparation(rooms, ViewStore(cache, PICTURE_SIZE), load_encoder("pooled"), zones=8, actor=actor)


def test_actors_begin_with_different_rooms_and_each_always_with_the_same(tmp_path: Path) -> None:
    rooms = rooms_of("kitchen", "train")

    def order(actor: str, given: tuple[RoomId, ...] = rooms) -> list[RoomId]:
        return list(preparation(tmp_path, actor, *given)._waiting)

    assert order("actor-0") == order("actor-0", tuple(reversed(rooms)))
    assert order("actor-0") != order("actor-1")
    assert sorted(order("actor-0")) == sorted(rooms)


def test_a_room_whose_preparation_was_stopped_is_prepared_by_the_next_call(tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        raise StoppedError

    rooms = preparation(tmp_path, "a", ROOM)
    with pytest.raises(StoppedError):
        rooms.next(stop)
    assert rooms.waiting == 1
    room = rooms.next()
    assert (room.graph.room, room.graph.digest) == (str(ROOM), room.views.digest)
    assert rooms.waiting == 0
