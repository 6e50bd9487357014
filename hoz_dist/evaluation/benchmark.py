"""The benchmark: a policy, Random and Oracle on the same fixed episodes in rooms that nobody trained in."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hoz_dist.evaluation.agents import Agent, OracleAgent, PolicyAgent, RandomAgent
from hoz_dist.evaluation.protocol import EPISODE_SEED
from hoz_dist.evaluation.trials import Evaluation, SourceFactory, run_trials, stored_views
from hoz_dist.nav.categories import SCENES
from hoz_dist.nav.episode import Episode
from hoz_dist.nav.rooms import Split
from hoz_dist.sim.episodes import episode_list
from hoz_dist.sim.room_views import RoomViews


@dataclass(frozen=True)
class Benchmark:
    """A fixed list of episodes in the rooms of a split."""

    split: Split
    rooms: tuple[RoomViews, ...]
    episodes: tuple[Episode, ...]

    @classmethod
    def of(cls, rooms: Sequence[RoomViews], split: Split, episodes_per_scene: int) -> "Benchmark":
        """Draw the list of episodes: equally many in every scene.

        Args:
            rooms: Rooms of one split.
            split: The split.
            episodes_per_scene: Number of episodes in each scene that has rooms.
        """
        episodes: list[Episode] = []
        for scene in SCENES:
            of_scene = [views for views in rooms if views.room.scene == scene]
            if of_scene:
                episodes += episode_list(of_scene, episodes_per_scene, EPISODE_SEED)
        return cls(split, tuple(rooms), tuple(episodes))

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes that have episodes."""
        present = {episode.room.scene for episode in self.episodes}
        return tuple(scene for scene in SCENES if scene in present)

    def run(
        self,
        agent: Agent,
        seeds: Sequence[int],
        source: SourceFactory = stored_views,
        progress: Callable[[int, int], None] | None = None,
    ) -> Evaluation:
        """Run one agent, one trial per seed; see `run_trials`."""
        return run_trials(agent, self.rooms, self.episodes, seeds, split=self.split, source=source, progress=progress)


@dataclass(frozen=True)
class Comparison:
    """A policy between the floor and the ceiling."""

    random: Evaluation
    policy: Evaluation
    oracle: Evaluation
    scenes: tuple[str, ...]

    @property
    def rows(self) -> tuple[Evaluation, Evaluation, Evaluation]:
        """The three evaluations, floor first."""
        return self.random, self.policy, self.oracle

    def to_json(self) -> dict[str, Any]:
        """Return the policy's figures, and beside them those by scene and of the baselines; all in percent."""
        return {
            **self.policy.to_json(),
            "scenes": _by_scene(self.policy, self.scenes),
            "baselines": {
                row.method: {**row.to_json(), "scenes": _by_scene(row, self.scenes)}
                for row in (self.random, self.oracle)
            },
        }


def compare(
    benchmark: Benchmark,
    policy: PolicyAgent,
    seeds: Sequence[int],
    source: SourceFactory = stored_views,
    progress: Callable[[int, str], None] | None = None,
) -> Comparison:
    """Run Random, a policy and Oracle on a benchmark.

    Args:
        benchmark: The episodes.
        policy: The policy.
        seeds: Seed of each trial's actions. Oracle draws nothing, so it has one trial.
        source: Makes the source of the policy's observations; Random and Oracle do not look.
        progress: Called with the number of episodes that have ended in all trials, and the agent's name.
    """
    before = 0

    def run(agent: Agent, trial_seeds: Sequence[int], views: SourceFactory = stored_views) -> Evaluation:
        nonlocal before

        def report(done: int, total: int) -> None:
            del total
            if progress is not None:
                progress(before + done, agent.name)

        evaluation = benchmark.run(agent, trial_seeds, views, report)
        before += len(evaluation.trials) * evaluation.episodes
        return evaluation

    return Comparison(
        random=run(RandomAgent(), seeds),
        policy=run(policy, seeds, source),
        oracle=run(OracleAgent(list(benchmark.rooms)), seeds[:1]),
        scenes=benchmark.scenes,
    )


def _by_scene(evaluation: Evaluation, scenes: Sequence[str]) -> Mapping[str, Any]:
    return {scene: evaluation.of_scene(scene).to_json() for scene in scenes}
