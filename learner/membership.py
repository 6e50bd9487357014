"""Tells who takes part in a run, and who left, with what the learner measured of each."""

import time
from collections.abc import Mapping
from typing import Any

from hoz_dist.wire.membership.liveliness import Members
from hoz_dist.wire.protocol.run_messages import LeftProcess, ProcessStatus


def live_processes(
    members: Members, actors: Mapping[tuple[str, int], Mapping[str, Any]], rejected: Mapping[str, int]
) -> tuple[ProcessStatus, ...]:
    """Return the holders of a live token.

    Args:
        members: Who holds one.
        actors: Summaries of `ActorStatistics` by name and incarnation. A process without one has not pushed yet; one
            that left has no token, and is not shown with the speed that it had.
        rejected: Number of rejected messages by the name of their sender.
    """
    return tuple(
        ProcessStatus(
            role=member.role,
            id=member.id,
            host=member.host,
            incarnation=member.incarnation,
            rooms=tuple(actor.get("rooms", ())),
            frames=actor.get("frames", 0),
            frames_per_second=actor.get("frames_per_second", 0.0),
            lag=actor.get("lag", 0.0),
            rejected=rejected.get(member.id, 0),
        )
        for member in members.current()
        for actor in (actors.get((member.id, member.incarnation), {}),)
    )


def left_processes(members: Members) -> tuple[LeftProcess, ...]:
    """Return who left and did not come back, the last one first."""
    now = time.monotonic()
    return tuple(LeftProcess(*departure.member, seconds=max(now - departure.time, 0.0)) for departure in members.left())
