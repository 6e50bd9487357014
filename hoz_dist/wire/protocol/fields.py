"""Specs of fields that hold our own words: rooms and results of episodes."""

from typing import Any, ClassVar

from hoz_dist.errors import UnknownNameError
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.schema import Bool, Int, Spec, Text


class RoomName:
    """Spec of a room; ``kitchen/3`` on the wire, a `RoomId` here."""

    def pack(self, value: RoomId) -> object:
        """Return the room's name."""
        return str(value)

    def unpack(self, raw: object, where: str) -> object:
        """Return the room of that name."""
        Text(64).check(raw, where)
        try:
            room = RoomId.parse(str(raw))
        except UnknownNameError as error:
            raise RejectedError(Reason.NAME, f"{where}: {error}") from error
        if str(room) != raw:
            raise RejectedError(Reason.NAME, f"{where} is {raw!r}; the room's name is {room}")
        return room

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not RoomId:
            raise RejectedError(Reason.TYPE, f"{where} is not a room but {type(value).__name__}")
        self.unpack(str(value), where)


class EpisodeFields:
    """Spec of an `EpisodeResult`; a list of its fields in order on the wire, since there are many of them."""

    FIELDS: ClassVar[tuple[Spec, ...]] = (
        RoomName(),
        Int(0, len(TARGETS) - 1),
        Bool(),
        Int(1, 10**6),
        Int(0, 10**6),
        Bool(),
        Int(0, 10**6),
    )

    def pack(self, value: EpisodeResult) -> object:
        """Return the list of the fields."""
        return [spec.pack(field) for spec, field in zip(self.FIELDS, value, strict=True)]

    def unpack(self, raw: object, where: str) -> object:
        """Return the result with those fields."""
        if type(raw) is not list or len(raw) != len(self.FIELDS):
            raise RejectedError(Reason.TYPE, f"{where} is not a list of {len(self.FIELDS)} fields")
        return EpisodeResult._make(spec.unpack(field, where) for spec, field in zip(self.FIELDS, raw, strict=True))

    def check(self, value: Any, where: str) -> None:
        """Judge a value; see `Spec.check`."""
        if type(value) is not EpisodeResult:
            raise RejectedError(Reason.TYPE, f"{where} is not an episode's result but {type(value).__name__}")
        for name, spec, field in zip(value._fields, self.FIELDS, value, strict=True):
            spec.check(field, f"{where}.{name}")
        if value.moves > value.actions:
            raise RejectedError(Reason.RANGE, f"{where} has more moves than actions")
        if value.success and not value.said_done:
            raise RejectedError(Reason.RANGE, f"{where} is a success without Done")
