"""The room graph: the zones of one room [4.1.1]."""

import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.graph.checks import check_zone_graph
from hoz_dist.graph.exploration import explore
from hoz_dist.graph.views import Views, views_at
from hoz_dist.graph.zones import ZONES, Clustering, cluster
from hoz_dist.nav.pose import GRID_M

EDGE_REACH_M: Final = 0.25
"""eps of Eq. 1, metres; the released code used 0.5."""


@dataclass(frozen=True, eq=False)
class RoomGraph:
    """K zones of one room. Nodes and edges of any float type become float64.

    Raises:
        InvalidValueError: Nodes and edges are not those of a zone graph.
    """

    room: str
    """Name of the room, such as ``kitchen/3``."""
    digest: str
    """Digest of the room's content (`hoz_dist.sim.room.Room.digest`)."""
    nodes: NDArray[np.float64]
    """delta(v_k): how often each category is seen in each zone, [K, N], in [0, 1]."""
    edges: NDArray[np.float64]
    """e(k, j): how close zones are, [K, K], in [0, 1], 1 on the diagonal."""

    def __post_init__(self) -> None:
        """Convert and check."""
        object.__setattr__(self, "nodes", np.array(self.nodes, dtype=np.float64))
        object.__setattr__(self, "edges", np.array(self.edges, dtype=np.float64))
        check_zone_graph(self.nodes, self.edges, self.nodes.shape[-1] if self.nodes.ndim else 0)


def explore_room(
    room: str,
    digest: str,
    *,
    transitions: NDArray[np.int32],
    positions: NDArray[np.int16],
    bags: NDArray[np.bool_],
    zones: int = ZONES,
    clustering: Clustering = "kmeans",
) -> RoomGraph:
    """Explore a room and make its graph; the same room gives the same graph, whoever explores it.

    Args:
        room: Name of the room.
        digest: Digest of the room's content.
        transitions: View after each action, int32 [V, 6].
        positions: Grid coordinates of the positions, int16 [P, 2]; V = 16 P.
        bags: Bag of objects of every view, bool [V, N].
        zones: K.
        clustering: How views become zones.

    Raises:
        InvalidValueError: K is out of range for the room.
    """
    views = views_at(explore(transitions, room), bags, positions)
    return build_room_graph(room, digest, views, zones, clustering)


def build_room_graph(
    room: str, digest: str, views: Views, zones: int = ZONES, clustering: Clustering = "kmeans"
) -> RoomGraph:
    """Make the graph of a room from views of it.

    Args:
        room: Name of the room; seeds the clustering.
        digest: Digest of the room's content.
        views: M views.
        zones: K.
        clustering: How views become zones.

    Raises:
        InvalidValueError: K is out of range, or there are fewer views than zones.
    """
    labels = room_zones(room, views, zones, clustering)
    return RoomGraph(room, digest, zone_nodes(views.bags, labels, zones), zone_edges(views.positions, labels, zones))


def room_zones(room: str, views: Views, zones: int = ZONES, clustering: Clustering = "kmeans") -> NDArray[np.int64]:
    """Return the zone of each view as `build_room_graph` has it, int64 [M].

    Raises:
        InvalidValueError: K is out of range, or there are fewer views than zones.
    """
    return cluster(views, zones, zlib.crc32(room.encode()), clustering)


def zone_nodes(bags: NDArray[np.bool_], labels: NDArray[np.int64], zones: int) -> NDArray[np.float64]:
    """Average the bags of each zone [4.1.1].

    Args:
        bags: f, bool [M, N].
        labels: Zone of each view, int64 [M]; every zone has a view.
        zones: K.

    Returns:
        delta(v_k), [K, N].
    """
    members = (labels == np.arange(zones)[:, None]).astype(np.float64)  # [K, M]
    return np.asarray(members @ bags.astype(np.float64) / members.sum(axis=1, keepdims=True))


def zone_edges(
    positions: NDArray[np.int16], labels: NDArray[np.int64], zones: int, reach_m: float = EDGE_REACH_M
) -> NDArray[np.float64]:
    """Compute the share of pairs of views, one in each zone, that are close [Eq. 1].

    Views of one position are counted together: P^2 instead of M^2 pairs (M = 16 P), the same sums.

    Args:
        positions: (x, z) of each view, grid units, int16 [M, 2].
        labels: Zone of each view, int64 [M]; every zone has a view.
        zones: K.
        reach_m: eps, the largest |x - x'| + |z - z'| of close views, metres.

    Returns:
        e(k, j), [K, K], symmetric, with 1 on the diagonal by definition.
    """
    places, place_of_view = np.unique(positions.astype(np.int64), axis=0, return_inverse=True)
    counts = np.zeros((zones, len(places)))
    np.add.at(counts, (labels, place_of_view), 1)
    steps = np.abs(places[:, None] - places[None]).sum(axis=-1)  # [P, P], L1 in grid units
    close = (steps <= np.floor(reach_m / GRID_M + 1e-9)).astype(np.float64)
    sizes = counts.sum(axis=1)
    edges: NDArray[np.float64] = (counts @ close @ counts.T) / np.outer(sizes, sizes)
    np.fill_diagonal(edges, 1.0)
    return edges
