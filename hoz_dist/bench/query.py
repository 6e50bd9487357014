"""`hoz-dist bench query`: questions for scene graphs, to an idle learner or to one that trains."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Literal

from hoz_dist.bench.bare import ask_bare
from hoz_dist.bench.report import Metric
from hoz_dist.bench.samples import room_graph
from hoz_dist.bench.timing import Contender, Progress, run_contests
from hoz_dist.client import HozClient
from hoz_dist.errors import NotFoundError
from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.codec import encode
from hoz_dist.wire.protocol.graphs import scene_graph_reply
from hoz_dist.wire.transport.session import open_client
from learner.service import catalogue_digests
from workers.link import LearnerLink

State = Literal["idle", "training"]
"""What the learner does meanwhile."""


def bench_query(
    endpoint: str,
    bare_endpoint: str,
    scene: str,
    state: State,
    *,
    clients: int,
    seconds: float,
    repeats: int,
    progress: Progress,
) -> dict[str, Metric]:
    """Measure how soon a scene graph comes, and how many of them in a second.

    One client asks again and again, then several do so at once. The limit is a question of Zenoh's own that a process
    without a learner answers with as many bytes, asked in turns with ours.

    Args:
        endpoint: Where the learner listens.
        bare_endpoint: Where `hoz_dist.bench.bare.answer_bare` listens.
        scene: Scene whose graph is asked for.
        state: What the learner does meanwhile, for the names of the figures.
        clients: Clients that ask at once, each with a session and a thread of its own.
        seconds: Length of one measurement.
        repeats: Measurements of each figure.
        progress: Told how far the work is.
    """
    rounds: dict[str, list[list[float]]] = {}
    contests = [
        partial(_asking, endpoint, bare_endpoint, scene, number, name, seconds, rounds)
        for number, name in ((1, "one client"), (clients, "several clients"))
    ]
    rates = run_contests(contests, repeats, progress)

    def latency(name: str, percentile: int) -> Metric:
        ours, bare = (
            # The first round warms up.
            [1000 * _percentile(times, percentile) for times in rounds[who][1:]]
            for who in (name, f"{name}, bare")
        )
        return Metric.of(ours, "ms", bare)

    return {
        f"query_{state}_p50_ms": latency("one client", 50),
        f"query_{state}_p99_ms": latency("one client", 99),
        f"query_{state}_several_p99_ms": latency("several clients", 99),
        f"query_{state}_per_second": Metric.of(rates["several clients"], "queries/s", rates["several clients, bare"]),
    }


def graph_bytes(scene: str, endpoint: str) -> bytes:
    """Return the answer to a question for a scene graph, as it travels."""
    with HozClient(endpoint) as client:
        return encode(scene_graph_reply(client.graph(scene), epoch=1))


def give_graph(endpoint: str, room: RoomId) -> None:
    """Tell a learner a room graph, made up but for the room's digest, so that there is a scene graph to ask for.

    Raises:
        HozError: It does not take it.
    """
    with open_client(endpoint) as session, LearnerLink(session, "bench", None, threading.Event()) as link:
        link.push_room_graph(room_graph(room, catalogue_digests()[str(room)], link.config.zones))


def scene_with_graph(endpoint: str) -> str:
    """Return a scene of which a learner has a graph.

    Raises:
        HozError: There is none, or no learner.
    """
    with HozClient(endpoint) as client:
        scenes: Mapping[str, object] = client.status()["scenes"]
    if not scenes:
        message = f"The learner at {endpoint} has no scene graph yet; wait until an actor has explored a room."
        raise NotFoundError(message)
    return next(iter(scenes))


@contextmanager
def _asking(
    endpoint: str,
    bare_endpoint: str,
    scene: str,
    clients: int,
    name: str,
    seconds: float,
    rounds: dict[str, list[list[float]]],
) -> Iterator[Mapping[str, Contender]]:
    with ExitStack() as stack:
        askers: dict[str, list[Callable[[], object]]] = {name: [], f"{name}, bare": []}
        for _ in range(clients):
            client = stack.enter_context(HozClient(endpoint))
            askers[name].append(partial(client.graph, scene))
            session = stack.enter_context(open_client(bare_endpoint))
            askers[f"{name}, bare"].append(partial(ask_bare, session))
        pool = stack.enter_context(ThreadPoolExecutor(clients))
        yield {
            who: partial(_ask_together, pool, asks, seconds, rounds.setdefault(who, [])) for who, asks in askers.items()
        }


def _ask_together(
    pool: ThreadPoolExecutor, asks: Sequence[Callable[[], object]], seconds: float, rounds: list[list[float]]
) -> float:
    """Ask in several threads for some seconds; returns questions per second and notes how long each took."""
    start = time.perf_counter()
    futures = [pool.submit(_times, ask, seconds) for ask in asks]
    times = [taken for future in futures for taken in future.result()]
    rounds.append(times)
    return len(times) / (time.perf_counter() - start)


def _times(ask: Callable[[], object], seconds: float) -> list[float]:
    times: list[float] = []
    start = time.perf_counter()
    now = start
    while now - start < seconds or not times:
        before = now
        ask()
        now = time.perf_counter()
        times.append(now - before)
    return times


def _percentile(times: Sequence[float], percentile: int) -> float:
    """Return the least of some times that so many percent do not exceed."""
    ordered = sorted(times)
    return ordered[max(0, -(-len(ordered) * percentile // 100) - 1)]
