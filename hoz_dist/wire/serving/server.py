"""The learner's side: receives pushes and answers questions.

Every queryable has a channel and a thread that drains it at once, because Zenoh drops the transport of a receiver that
lets messages wait. Pushes are checked and then wait in one bounded queue for the learner; questions are answered on the
spot from snapshots. Whatever is wrong with a message, the thread lives on and the sender gets one answer.
"""

from collections.abc import Callable, Iterable
from typing import Final

from zenoh import KeyExpr, Query, Session

from hoz_dist.closing import Closing
from hoz_dist.errors import HozError
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.stages import StageClock
from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.codec import checksum, decode, encode
from hoz_dist.wire.protocol.keys import Keys, sender_of
from hoz_dist.wire.protocol.pushes import EpisodesPush, GradientPush, Push, RoomGraphPush
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.rejections import Rejections
from hoz_dist.wire.protocol.trajectories import TrajectoryPush
from hoz_dist.wire.serving.inbox import Inbox, Reaper, Request
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.publishing import NewestPublisher
from hoz_dist.wire.transport.queryable import (
    answer,
    check_question,
    declare_queryable,
    parameters_of,
    refuse,
    reply,
)

_CHECKSUM_BYTES: Final = 8
MOST_BYTES_OF_GRAPHS: Final = 512 * 1024
"""What one question is answered with; more would stand in the queue of a slow link in front of all else."""
_BESIDE_GRADIENT: Final = 4096
"""Room for all but the numbers in the encoded form of a gradient, bytes."""


class Server(Closing):
    """Serves a run on a session.

    Args:
        session: Session of the learner.
        keys: Keys of the run.
        snapshots: What questions are answered from.
        rejections: Where to count rejections.
        graphs: Graphs to serve from the first question on.
        inbox: Where pushes are to wait.
        parameters: Number of parameters of the policy, P: a gradient that is longer is not even copied; None if any
            length will do.
        rollout_bytes: Length of the longest rollout of the run as a message; None if any length will do.
        clock: Measures how long receiving pushes takes, as the stage ``receive``.

    Attributes:
        session: The session.
        inbox: Where pushes wait; the learner takes them out and answers them.
        rejections: What was rejected so far, by the wire and by the learner.
        snapshots: The snapshots.
    """

    def __init__(
        self,
        session: Session,
        keys: Keys,
        snapshots: Snapshots,
        *,
        rejections: Rejections | None = None,
        graphs: Iterable[SceneGraph | RoomGraph] = (),
        inbox: Inbox | None = None,
        parameters: int | None = None,
        rollout_bytes: int | None = None,
        clock: StageClock | None = None,
    ) -> None:
        self.inbox = inbox if inbox is not None else Inbox()  # an empty one is false
        self.rejections = rejections or Rejections()
        self.snapshots = snapshots
        self.session = session
        self._clock = clock or StageClock()
        self._keys = keys
        self._epoch = snapshots.config.epoch
        self._most_bytes_of: dict[type[Push], int] = {}
        if parameters is not None:
            self._most_bytes_of[GradientPush] = min(4 * parameters + _BESIDE_GRADIENT, GradientPush.MOST_BYTES)
        if rollout_bytes is not None:
            self._most_bytes_of[TrajectoryPush] = min(rollout_bytes, TrajectoryPush.MOST_BYTES)
        self._publishers: dict[str, NewestPublisher] = {}
        for graph in graphs:
            self.put_graph(graph)
        handlers: dict[str, Callable[[Query], None]] = {
            keys.all_grads: lambda query: self._receive(query, GradientPush),
            keys.all_rollouts: lambda query: self._receive(query, EpisodesPush, TrajectoryPush),
            keys.all_rooms: lambda query: self._receive(query, RoomGraphPush),
            keys.config: self._limited(lambda query: answer(query, keys.config, snapshots.config)),
            keys.status: self._limited(lambda query: answer(query, keys.status, snapshots.status())),
            keys.all_graphs: self._limited(self._answer_graph),
            keys.all_plans: self._limited(self._answer_plan),
        }
        self._queryables = [
            declare_queryable(session, key, handle, self._epoch, self.rejections) for key, handle in handlers.items()
        ]
        self._reaper = Reaper(self.inbox.put_off_late)

    def put_graph(self, graph: SceneGraph | RoomGraph) -> None:
        """Serve a graph instead of the one of the same scene or room so far, and publish it."""
        name = graph.scene if isinstance(graph, SceneGraph) else graph.room
        snapshot = self.snapshots.put(name, graph)
        if name not in self._publishers:
            self._publishers[name] = NewestPublisher(self.session, self._keys.graph(name))
        self._publishers[name].publish(snapshot.payload)

    def close(self) -> None:
        """Stop serving; who asks from now on gets no answer."""
        self._reaper.close()
        for queryable in self._queryables:
            queryable.close()
        for publisher in self._publishers.values():
            publisher.close()

    def _receive(self, query: Query, *expected: type[Push]) -> None:
        """Check a push, and let it wait for the learner."""
        key = str(query.key_expr)
        try:
            with self._clock("receive"):
                message, size = self._checked(query, key, *expected)
        except RejectedError as error:
            self.rejections.count(error.reason, error.detail, sender_of(key))
            answer(query, key, Refused.of(error, self._epoch))
            return
        self.inbox.add(Request(query, message, size, self.rejections, self._epoch))

    def _checked(self, query: Query, key: str, *expected: type[Push]) -> tuple[Push, int]:
        """Return the message of a push, and the length of its encoded form.

        Raises:
            RejectedError: It was damaged on the way, is not as it should be, or came on the key of another.
        """
        payload, attachment = query.payload, query.attachment
        size = len(payload) if payload is not None else 0
        most = max(self._most_bytes_of.get(kind, kind.MOST_BYTES) for kind in expected)
        if size > most:  # not even copied
            raise RejectedError(Reason.SIZE, f"the message has {size} bytes, more than {most}")
        data = payload.to_bytes() if payload is not None else b""
        if attachment is None or len(attachment) != _CHECKSUM_BYTES or attachment.to_bytes() != checksum(data):
            raise RejectedError(Reason.CHECKSUM, f"the {size} bytes do not have the checksum sent along")
        message = decode(data, *expected)
        if key != self._key_of(message):
            raise RejectedError(Reason.IDENTITY, f"a {message.KIND} of {message.actor} came on {key}")
        return message, size

    def _key_of(self, message: Push) -> str:
        """Return the key that a push must come on."""
        match message:
            case GradientPush():
                return self._keys.grads(message.actor)
            case EpisodesPush() | TrajectoryPush():
                return self._keys.rollouts(message.actor)
            case RoomGraphPush():
                return self._keys.room(message.actor, message.room)
            case _:  # pragma: no cover - every kind that is received stands above
                raise TypeError(message)

    def _limited(self, handle: Callable[[Query], None]) -> Callable[[Query], None]:
        """Return what refuses questions that are too long, and handles the others."""

        def refuse_or_handle(query: Query) -> None:
            try:
                check_question(query)
            except RejectedError as error:
                refuse(query, error, self._epoch, self.rejections)
            else:
                handle(query)

        return refuse_or_handle

    def _answer_graph(self, query: Query) -> None:
        """Answer with the graph of that name, or with all graphs that a wildcard selects."""
        prefix = self._keys.graph("")
        name = str(query.key_expr).removeprefix(prefix)
        if "*" not in name:
            self._answer_or_refuse(query, lambda: self.snapshots.graph(name).payload)
            return
        try:
            selected = self._selected(query.key_expr, prefix)
        except RejectedError as error:
            refuse(query, error, self._epoch, self.rejections)
            return
        with query:
            for key, payload in selected.items():
                query.reply(key, payload)

    def _selected(self, key_expr: KeyExpr, prefix: str) -> dict[str, bytes]:
        """Return the encoded graphs that a wildcard selects, by key.

        Raises:
            RejectedError: They are too much for one question.
        """
        selected, size = {}, 0
        for name, (_, payload) in self.snapshots.graphs.items():
            if key_expr.intersects(KeyExpr(prefix + name)):
                selected[prefix + name] = payload
                size += len(payload)
            if size > MOST_BYTES_OF_GRAPHS:
                limit = f"{MOST_BYTES_OF_GRAPHS >> 10} KiB"
                raise RejectedError(
                    Reason.SIZE, f"these graphs have more than {limit}: ask scene by scene, or room by room"
                )
        return selected

    def _answer_plan(self, query: Query) -> None:
        """Answer with a plan for the target and the seen categories that the parameters name."""
        scene = str(query.key_expr).removeprefix(self._keys.plan(""))
        self._answer_or_refuse(query, lambda: encode(self.snapshots.plan(scene, parameters_of(query))))

    def _answer_or_refuse(self, query: Query, make: Callable[[], bytes]) -> None:
        """Answer a question with an encoded message, or say in one sentence what is wrong with it."""
        try:
            payload = make()
        except HozError as error:
            refuse(query, error, self._epoch, self.rejections)
        else:
            reply(query, str(query.key_expr), payload)
