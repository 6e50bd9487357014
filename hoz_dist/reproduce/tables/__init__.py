"""The tables, by name. To add one: write its rows in a module here and list it in `TABLES`."""

from typing import Final

from hoz_dist.reproduce.row import Table
from hoz_dist.reproduce.tables.apartments import APARTMENTS
from hoz_dist.reproduce.tables.components import COMPONENTS
from hoz_dist.reproduce.tables.graphs import CLUSTERING, EDGE_COST, MERGE_ORDER, RANDOM_GRAPH, SUBGOAL, ZONES
from hoz_dist.reproduce.tables.methods import METHODS

TABLES: Final[dict[str, Table]] = {
    table.name: table
    for table in (
        SUBGOAL,
        COMPONENTS,
        METHODS,
        CLUSTERING,
        RANDOM_GRAPH,
        APARTMENTS,
        ZONES,
        MERGE_ORDER,
        EDGE_COST,
    )
}
"""In the paper's order."""
