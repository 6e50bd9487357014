"""`HozClient`: what a robot or a notebook uses to ask a learner for graphs and plans.

    >>> with HozClient("tcp/127.0.0.1:7447") as client:  # doctest: +SKIP
    ...     graph = client.graph("kitchen")
    ...     plan = client.plan("kitchen", target="Microwave", seen=["Sink", "Toaster"])

It needs neither a learning library nor a simulator, and starts in a fraction of a second.
"""

import threading
from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Final, TypeVar

from hoz_dist.closing import Closing
from hoz_dist.errors import ConnectionFailedError, HozError, InvalidValueError, NotFoundError, UnknownNameError
from hoz_dist.graph.planner import Plan
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS, category_index, scene_index
from hoz_dist.nav.rooms import RoomId
from hoz_dist.waiting import Backoff, Deadline
from hoz_dist.wire.client.discovery import find_run, find_runs
from hoz_dist.wire.client.epochs import of_highest_epoch
from hoz_dist.wire.protocol.answers import Refused
from hoz_dist.wire.protocol.codec import PROTOCOL_VERSION
from hoz_dist.wire.protocol.graph_messages import PlanReply, RoomGraphReply, SceneGraphReply
from hoz_dist.wire.protocol.graphs import plan_of, room_graph_of, scene_graph_of
from hoz_dist.wire.protocol.keys import SEEN_SEPARATOR, Keys
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.run_messages import ConfigReply, StatusReply
from hoz_dist.wire.transport.ask import Answers, ask, messages_in
from hoz_dist.wire.transport.endpoint import DEFAULT_ENDPOINT
from hoz_dist.wire.transport.session import open_client

if TYPE_CHECKING:
    from hoz_dist.wire.transport.credentials import Credentials

ANSWER_S: Final = 2.0
"""How long an answer may take, seconds."""
MOST_KEPT: Final = 256
"""Answers that are kept: those of all graphs, and of as many plans."""
_ERRORS: Final[dict[str, type[HozError]]] = {
    Reason.NAME: UnknownNameError,
    Reason.NOT_FOUND: NotFoundError,
    Reason.MALFORMED: InvalidValueError,
}

Reply = ConfigReply | StatusReply | SceneGraphReply | RoomGraphReply | PlanReply
R = TypeVar("R", ConfigReply, StatusReply, SceneGraphReply, RoomGraphReply, PlanReply)


class HozClient(Closing):
    """Asks the learner of a run. Use it in a ``with`` statement; its methods may be called from several threads.

    Args:
        endpoint: Where the learner or its router listens, for example ``tcp/127.0.0.1:7447``.
        run: Name of the run; None for the only one that is found.
        credentials: Keys for an endpoint that asks for them, ``load_credentials("keys/viewer-v0")`` for example.

    Raises:
        InvalidValueError: The endpoint is malformed, or is none for the credentials.
        ConnectionFailedError: Nobody answers there, or lets us in.
    """

    def __init__(
        self, endpoint: str = DEFAULT_ENDPOINT, run: str | None = None, credentials: "Credentials | None" = None
    ) -> None:
        self.endpoint = endpoint
        self._credentials = credentials
        self._run = run
        self._keys: Keys | None = None
        self._read: dict[str, tuple[Answers, Reply]] = {}
        """What came last for each question, and what it says."""
        self._open = ExitStack()
        self._session = self._open.enter_context(open_client(endpoint, credentials=credentials))

    def runs(self) -> list[str]:
        """Return the names of the runs whose learners answer now, sorted."""
        return [config.run for config in find_runs(self._session, ANSWER_S)]

    def config(self) -> dict[str, Any]:
        """Return what an actor needs to join: ``{"protocol", "run", "epoch", "categories", "config": {...}}``.

        Raises:
            HozError: No run was found, several were, or the learner does not answer.
        """
        reply = self._ask(self._keys_of_run().config, ConfigReply)
        return {
            "protocol": PROTOCOL_VERSION,
            "run": reply.run,
            "epoch": reply.epoch,
            "categories": list(reply.categories),
            "config": reply.config,
        }

    def status(self) -> dict[str, Any]:
        """Return who takes part and how it goes: ``{"version", "epoch", "processes": [...], "rejected": {...}, ...}``.

        Raises:
            HozError: No run was found, several were, or the learner does not answer.
        """
        reply = self._ask(self._keys_of_run().status, StatusReply)
        fields = reply.pack()
        details = fields.pop("details")
        assert isinstance(details, dict)  # noqa: S101 - the message was checked when it was made
        return fields | {name: value for name, value in details.items() if name not in fields}

    def graph(self, scene: str) -> SceneGraph:
        """Return the newest graph of a scene.

        Raises:
            UnknownNameError: There is no such scene.
            NotFoundError: No room of it has been explored yet, or there is no run.
            HozError: Several runs were found, or the learner does not answer.
        """
        scene_index(scene)
        reply = self._ask(self._keys_of_run().graph(scene), SceneGraphReply)
        _check_answers(scene, reply.scene)
        return scene_graph_of(reply)

    def room_graph(self, room: str) -> RoomGraph:
        """Return the graph of a room, for example ``kitchen/3``.

        Raises:
            UnknownNameError: There is no such room.
            NotFoundError: It has not been explored yet, or there is no run.
            HozError: Several runs were found, or the learner does not answer.
        """
        name = str(RoomId.parse(room))
        reply = self._ask(self._keys_of_run().graph(name), RoomGraphReply)
        _check_answers(name, str(reply.room))
        return room_graph_of(reply)

    def plan(self, scene: str, target: str, seen: Sequence[str]) -> Plan:
        """Return where to go in a scene to find a target.

        Args:
            scene: The scene.
            target: Category to find.
            seen: Categories that are seen now, at least one.

        Raises:
            UnknownNameError: There is no such scene or category.
            InvalidValueError: Nothing is seen.
            NotFoundError: No room of the scene has been explored yet, or there is no run.
            HozError: Several runs were found, or the learner does not answer.
        """
        scene_index(scene)
        wanted, *visible = (TARGETS[category_index(name)] for name in (target, *seen))
        selector = f"{self._keys_of_run().plan(scene)}?target={wanted};seen={SEEN_SEPARATOR.join(visible)}"
        return plan_of(self._ask(selector, PlanReply))

    def close(self) -> None:
        """Close the session."""
        self._open.close()

    def _keys_of_run(self) -> Keys:
        """Return the keys of the run, which is looked for when it is first needed."""
        if self._keys is None:
            self._keys = Keys(find_run(self._session, self._run, ANSWER_S).run)
        return self._keys

    def _ask(self, selector: str, expected: type[R]) -> R:
        """Ask one question; of several learners the one of the highest epoch counts.

        Raises:
            HozError: The learner says that it cannot answer, or does not answer at all.
        """
        deadline, backoff = Deadline(ANSWER_S), Backoff(threading.Event())
        while not (answers := ask(self._session, selector, timeout_s=ANSWER_S)):
            # Zenoh also gives an empty answer while a learner or router that was away is coming back.
            if deadline.passed:
                raise ConnectionFailedError(self._no_answer())
            backoff.pause(deadline)
        return self._read_once(selector, answers, expected)

    def _read_once(self, selector: str, answers: Answers, expected: type[R]) -> R:
        """Return what answers say, of which there are some.

        Most often it is the same as last time, and to read and check a graph takes longer than to ask for it.

        Raises:
            HozError: The learner says that it cannot answer, or nothing can be read.
        """
        known, said = self._read.get(selector, (None, None))
        if known == answers and isinstance(said, expected):
            return said
        replies = messages_in(answers, expected, Refused)
        reply = of_highest_epoch(replies)  # type: ignore[type-var]  # each of these kinds has an epoch
        if isinstance(reply, Refused):
            raise _ERRORS.get(reply.reason, HozError)(reply.detail)
        assert isinstance(reply, expected)  # noqa: S101 - there are answers, and no other kind was expected
        if len(self._read) >= MOST_KEPT:
            self._read.clear()
        self._read[selector] = answers, reply
        return reply

    def _no_answer(self) -> str:
        """Say what may be wrong when nobody answers; a router that denies something says nothing."""
        message = f"The learner at {self.endpoint} does not answer; it may have stopped, or be starting again"
        if self._credentials is None:
            return f"{message}."
        return f"{message}, or the key in '{self._credentials.folder}' may not allow the question."


def _check_answers(asked: str, told: str) -> None:
    """Check that an answer is about what was asked.

    Raises:
        RejectedError: It is not.
    """
    if told != asked:
        raise RejectedError(Reason.IDENTITY, f"the learner was asked for {asked} and answered with {told}")
