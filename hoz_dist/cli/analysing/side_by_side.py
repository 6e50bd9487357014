"""Which ways through which rooms are drawn side by side."""

from collections.abc import Mapping, Sequence
from typing import Final

from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.evaluation.trace import EpisodeTrace
from hoz_dist.viz.trajectory import Trajectory, trajectories_of

MOST_AGENTS: Final = 4
"""Agents whose ways are drawn side by side."""


def side_by_side(benchmark: Benchmark, shown: Mapping[str, Sequence[EpisodeTrace]]) -> list[Trajectory]:
    """Return the ways of all shown agents in one episode of each scene, agent by agent.

    The longest episode by L* that one agent wins and another loses; if there is none, the longest.

    Args:
        benchmark: The episodes.
        shown: One trial of each agent over all of them, by the agent's name.
    """
    episodes, trials = benchmark.episodes, list(shown.values())

    def telling(slot: int) -> tuple[bool, int]:
        return len({trial[slot].result.success for trial in trials}) > 1, episodes[slot].optimal

    chosen = [
        max((slot for slot, episode in enumerate(episodes) if episode.room.scene == scene), key=telling)
        for scene in benchmark.scenes
    ]
    ways = [trajectories_of([trial[slot] for slot in chosen], benchmark.rooms, name) for name, trial in shown.items()]
    return [way for of_episode in zip(*ways, strict=True) for way in of_episode]
