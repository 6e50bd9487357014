"""What a learner tells of its run; frozen, and checked when they are made."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from hoz_dist.wire.protocol.maps import Counts, JsonObject
from hoz_dist.wire.protocol.message import (
    CATEGORIES,
    NAME,
    Message,
)
from hoz_dist.wire.protocol.schema import Int, Many, Real, Record, Structure, Text


@dataclass(frozen=True, eq=False)
class ConfigReply(Message):
    """All that an actor needs to join.

    Attributes:
        run: Name of the run.
        epoch: Epoch of the learner.
        categories: [N] target categories, in the order of the graphs' columns.
        config: The run's configuration, what JSON can hold.
    """

    KIND: ClassVar[str] = "config"

    run: Annotated[str, NAME]
    epoch: Annotated[int, Int()]
    categories: Annotated[tuple[str, ...], CATEGORIES]
    config: Annotated[dict[str, Any], JsonObject()]


@dataclass(frozen=True, eq=False)
class ProcessStatus(Structure):
    """A process that holds a live token.

    Attributes:
        role: ``learner``, ``standby`` or ``actor``.
        id: Its name.
        host: Name of the machine that it runs on.
        incarnation: Random number that it drew when it started; tells two processes of one name apart.
        rooms: Rooms that it trains in, as far as the learner knows.
        frames: Environment steps that it has contributed.
        frames_per_second: Its speed, as the learner measures it.
        lag: Mean policy lag of its recent gradients, as the learner measures it.
        rejected: Number of its messages that were rejected.
    """

    role: Annotated[str, NAME]
    id: Annotated[str, NAME]
    host: Annotated[str, NAME]
    incarnation: Annotated[int, Int()]
    rooms: Annotated[tuple[str, ...], Many(Text(64), 256)] = ()
    frames: Annotated[int, Int()] = 0
    frames_per_second: Annotated[float, Real(0.0)] = 0.0
    lag: Annotated[float, Real(0.0)] = 0.0
    rejected: Annotated[int, Int()] = 0


@dataclass(frozen=True, eq=False)
class LeftProcess(Structure):
    """A process whose token is gone.

    Attributes:
        role: ``learner``, ``standby`` or ``actor``.
        id: Its name.
        host: Name of the machine that it ran on.
        incarnation: Random number that it drew when it started.
        seconds: How long ago its token went, seconds.
    """

    role: Annotated[str, NAME]
    id: Annotated[str, NAME]
    host: Annotated[str, NAME]
    incarnation: Annotated[int, Int()]
    seconds: Annotated[float, Real(0.0)]


@dataclass(frozen=True, eq=False)
class StatusReply(Message):
    """Who takes part and how it goes.

    Attributes:
        version: Version of the newest parameters.
        epoch: Epoch of the learner.
        processes: Holders of a live token.
        left: Who held a token and does so no more, the last one first.
        rejected: Number of rejected messages by reason; reasons that never occurred are left out.
        details: More for people, what JSON can hold; none of its names is one of the above.
    """

    KIND: ClassVar[str] = "status"
    MOST_BYTES: ClassVar[int] = 4 * 1024 * 1024
    MOST_VALUES: ClassVar[int] = 256 * 1024

    version: Annotated[int, Int()]
    epoch: Annotated[int, Int()]
    processes: Annotated[tuple[ProcessStatus, ...], Many(Record(ProcessStatus), 4096)]
    left: Annotated[tuple[LeftProcess, ...], Many(Record(LeftProcess), 256)]
    rejected: Annotated[dict[str, int], Counts()]
    details: Annotated[dict[str, Any], JsonObject()]
