"""What the learner answers without being asked itself: immutable snapshots that it replaces now and then.

Questions are answered at once by the thread that receives them, also while the learner computes.
"""

from collections.abc import Callable, Mapping
from typing import Final

from hoz_dist.errors import InvalidValueError, NotFoundError, UnknownNameError
from hoz_dist.nav.categories import SCENES, category_index
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.messages import ConfigReply, PlanReply, RoomGraphReply, SceneGraphReply, StatusReply

GraphMessage = SceneGraphReply | RoomGraphReply
Planner = Callable[[SceneGraphReply, str, tuple[str, ...]], PlanReply]
"""Plans on a scene graph, given the target's and the seen categories' names."""
_SEPARATOR: Final = "+"


class Snapshots:
    """The newest of all that can be asked for.

    Each part is replaced as a whole, so that readers in other threads see the old or the new one.

    Args:
        config: Answer to ``config``.
        status: Makes the answer to ``status``; called in the server's thread.
        plan: Makes a plan; called in the server's thread.
    """

    def __init__(self, config: ConfigReply, status: Callable[[], StatusReply], plan: Planner) -> None:
        self.config = config
        self._status = status
        self._plan = plan
        self._graphs: Mapping[str, GraphMessage] = {}

    @property
    def graphs(self) -> Mapping[str, GraphMessage]:
        """Graphs by the name of their scene or room."""
        return self._graphs

    def set_graphs(self, graphs: Mapping[str, GraphMessage]) -> None:
        """Replace all graphs."""
        self._graphs = dict(graphs)

    def status(self) -> StatusReply:
        """Return who takes part and how it goes."""
        return self._status()

    def graph(self, name: str) -> GraphMessage:
        """Return the graph of a scene or of a room.

        Raises:
            UnknownNameError: There is no such scene or room.
            NotFoundError: There is no graph of it yet.
        """
        if name not in SCENES:
            RoomId.parse(name)
        if name not in self._graphs:
            message = f"There is no graph of '{name}' yet: no actor of this run has explored {_where(name)}."
            raise NotFoundError(message)
        return self._graphs[name]

    def plan(self, scene: str, parameters: Mapping[str, str]) -> PlanReply:
        """Return a plan in a scene.

        Args:
            scene: The scene.
            parameters: ``target``: a category; ``seen``: categories joined by ``+``, at least one.

        Raises:
            UnknownNameError: There is no such scene or category.
            NotFoundError: There is no graph of the scene yet.
            InvalidValueError: A parameter is missing.
        """
        if scene not in SCENES:
            raise UnknownNameError.of("scene", scene, SCENES)
        target, seen = parameters.get("target", ""), tuple(filter(None, parameters.get("seen", "").split(_SEPARATOR)))
        if not target or not seen:
            message = "A plan needs a target and at least one category that is seen, as in ?target=Microwave;seen=Sink."
            raise InvalidValueError(message)
        for name in (target, *seen):
            category_index(name)
        graph = self.graph(scene)
        assert isinstance(graph, SceneGraphReply)  # noqa: S101 - a scene's name holds a scene's graph
        return self._plan(graph, target, seen)


def _where(name: str) -> str:
    return f"room {name}" if "/" in name else f"a room of scene {name}"
