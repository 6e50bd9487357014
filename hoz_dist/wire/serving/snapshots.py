"""What questions are answered from: immutable values that the learner replaces now and then.

Questions are answered at once by the thread that receives them, also while the learner computes.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.graph.planner import EdgeCost, plan_for
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import SCENES, scene_index
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.graph_messages import PlanReply
from hoz_dist.wire.protocol.graphs import plan_reply, room_graph_reply, scene_graph_reply
from hoz_dist.wire.protocol.keys import SEEN_SEPARATOR
from hoz_dist.wire.protocol.run_messages import ConfigReply, StatusReply


class GraphSnapshot(NamedTuple):
    """A graph, and the answer to questions for it: it is asked for far more often than it changes."""

    graph: SceneGraph | RoomGraph
    payload: bytes
    """The encoded message."""


class Snapshots:
    """The newest of all that can be asked for.

    Each part is replaced as a whole, so that a reader in another thread sees the old or the new one.

    Args:
        config: Answer to ``config``.
        status: Makes the answer to ``status``; called in a thread of the server's.
        edge_cost: What makes a path short in plans.

    Attributes:
        graphs: Graphs by the name of their scene or room.
    """

    def __init__(self, config: ConfigReply, status: Callable[[], StatusReply], edge_cost: EdgeCost) -> None:
        self.config = config
        self.status = status
        self.graphs: Mapping[str, GraphSnapshot] = {}
        self._edge_cost = edge_cost

    def put(self, name: str, graph: SceneGraph | RoomGraph) -> GraphSnapshot:
        """Replace the graph of a scene or of a room.

        Raises:
            RejectedError: It is of other rooms, categories or sizes than may travel.
        """
        epoch = self.config.epoch
        if isinstance(graph, SceneGraph):
            snapshot = GraphSnapshot(graph, encode(scene_graph_reply(graph, epoch)))
        else:
            snapshot = GraphSnapshot(graph, encode(room_graph_reply(graph, epoch)))
        self.graphs = {**self.graphs, name: snapshot}
        return snapshot

    def graph(self, name: str) -> GraphSnapshot:
        """Return the graph of a scene or of a room.

        Raises:
            UnknownNameError: There is no such scene or room.
            NotFoundError: There is no graph of it yet.
        """
        found = self.graphs.get(name)
        if found is not None:
            return found
        if name not in SCENES:
            RoomId.parse(name)
        where = f"room {name}" if "/" in name else f"a room of scene {name}"
        message = f"There is no graph of '{name}' yet: no actor of this run has explored {where}."
        raise NotFoundError(message)

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
        scene_index(scene)
        target, seen = parameters.get("target", ""), parameters.get("seen", "")
        if not target:
            message = "A plan needs a target, as in ?target=Microwave;seen=Sink+Toaster."
            raise InvalidValueError(message)
        graph = self.graph(scene).graph
        assert isinstance(graph, SceneGraph)  # noqa: S101 - a scene's name stands for a scene graph
        names = [name for name in seen.split(SEEN_SEPARATOR) if name]
        return plan_reply(plan_for(graph, target, names, self._edge_cost), self.config.epoch)
