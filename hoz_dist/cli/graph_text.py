"""Scene graphs and plans as text for people, and for Graphviz."""

from typing import TYPE_CHECKING

from hoz_dist.graph.planner import Plan
from hoz_dist.graph.scene_graph import SceneGraph, top_objects

if TYPE_CHECKING:
    from rich.table import Table


def title(graph: SceneGraph) -> str:
    """Name a graph and what it is made of."""
    rooms = f" of {len(graph.rooms)} {'room' if len(graph.rooms) == 1 else 'rooms'}" if graph.rooms else ""
    return f"Scene graph of {graph.scene}{rooms}, version {graph.version}"


def zone_table(graph: SceneGraph, top: int) -> "Table":
    """List zones with the ``top`` categories that are seen most often in them."""
    from rich.table import Table

    table = Table("zone", "seen most often (share of its views)", title="Zones")
    for zone in range(graph.zones):
        objects = ", ".join(f"{name} {share:.2f}" for name, share in top_objects(graph, zone, top))
        table.add_row(str(zone), objects or "nothing")
    return table


def edge_table(graph: SceneGraph) -> "Table":
    """List how close zones are."""
    from rich.table import Table

    table = Table("", *map(str, range(graph.zones)), title="Edges (share of pairs of views that are close)")
    for zone in range(graph.zones):
        table.add_row(str(zone), *(f"{edge:.3f}" for edge in graph.edges[zone]))
    return table


def plan_text(graph: SceneGraph, plan: Plan, target: str) -> str:
    """Say a plan for a target category on the graph that it was made on."""

    def zone(number: int) -> str:
        return f"zone {number} ({', '.join(name for name, _ in top_objects(graph, number, 3)) or 'nothing seen'})"

    index = graph.category(target)
    category, frequency = graph.categories[index], graph.nodes[plan.target, index]
    return "\n".join(
        [
            f"You are in {zone(plan.current)}.",
            f"{category} is most likely in {zone(plan.target)}: seen in {frequency:.0%} of its views.",
            f"Go to {zone(plan.subgoal)} next." if plan.subgoal != plan.current else "Look around here.",
            f"Path: {' > '.join(map(str, plan.path))}, probability {plan.probability:.3g}.",
        ]
    )


def dot(graph: SceneGraph, top: int) -> str:
    """Write a graph for Graphviz (``dot -Tsvg``): zones with what is seen in them, edges as thick as they are close."""
    lines = [f'graph "{graph.scene}" {{', "  node [shape=box, style=rounded];"]
    for zone in range(graph.zones):
        objects = "".join(f"\\n{name} {share:.2f}" for name, share in top_objects(graph, zone, top))
        lines.append(f'  {zone} [label="zone {zone}{objects}"];')
    for start in range(graph.zones):
        for end in range(start + 1, graph.zones):
            edge = graph.edges[start, end]
            if edge > 0:
                lines.append(f'  {start} -- {end} [label="{edge:.3f}", penwidth={0.5 + 5 * edge:.2f}];')
    return "\n".join([*lines, "}"])
