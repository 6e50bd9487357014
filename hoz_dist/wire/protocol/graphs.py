"""Graphs and plans as messages, and back."""

from hoz_dist.graph.planner import Plan
from hoz_dist.graph.room_graph import RoomGraph
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.graph_messages import PlanReply, RoomGraphReply, SceneGraphReply


def scene_graph_reply(graph: SceneGraph, epoch: int) -> SceneGraphReply:
    """Return the message for a scene graph that the learner of an epoch serves.

    Raises:
        RejectedError: It is of other rooms, categories or sizes than may travel.
    """
    rooms = tuple(map(RoomId.parse, graph.rooms))
    return SceneGraphReply(epoch, graph.scene, graph.version, rooms, graph.categories, graph.nodes, graph.edges)


def scene_graph_of(reply: SceneGraphReply) -> SceneGraph:
    """Return the scene graph that a message holds.

    Raises:
        InvalidValueError: Its numbers are not those of a graph.
    """
    rooms = tuple(map(str, reply.rooms))
    return SceneGraph(reply.scene, reply.version, rooms, reply.categories, reply.nodes, reply.edges)


def room_graph_reply(graph: RoomGraph, epoch: int) -> RoomGraphReply:
    """Return the message for a room graph that the learner of an epoch serves; its categories are the targets.

    Raises:
        RejectedError: It is of another room or size than may travel.
    """
    return RoomGraphReply(epoch, RoomId.parse(graph.room), graph.digest, TARGETS, graph.nodes, graph.edges)


def room_graph_of(reply: RoomGraphReply) -> RoomGraph:
    """Return the room graph that a message holds.

    Raises:
        InvalidValueError: Its numbers are not those of a graph.
    """
    return RoomGraph(str(reply.room), reply.digest, reply.nodes, reply.edges)


def plan_reply(plan: Plan, epoch: int) -> PlanReply:
    """Return the message for a plan of the learner of an epoch."""
    return PlanReply(epoch, plan.current, plan.target, plan.subgoal, plan.path, plan.probability)


def plan_of(reply: PlanReply) -> Plan:
    """Return the plan that a message holds."""
    return Plan(reply.current, reply.target, reply.subgoal, reply.path, reply.probability)
