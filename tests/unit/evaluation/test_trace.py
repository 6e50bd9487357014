from dataclasses import replace

import numpy as np
import pytest

from hoz_dist.config import RunConfig
from hoz_dist.evaluation.agents import OracleAgent, RandomAgent
from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.evaluation.loading import load_agent
from hoz_dist.evaluation.trace import trace_episodes
from hoz_dist.graph.planner import next_hops
from hoz_dist.graph.update import current_zone
from hoz_dist.nav.actions import Action
from hoz_dist.nav.categories import SCENES
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.sim.room_views import RoomViews
from tests.unit.graph.samples import random_scene_graph
from tests.unit.sim.making import CHANNELS, random_views

ROOMS = tuple(
    random_views(RoomId(scene, 21), seed=n, width=6, depth=6) for n, scene in enumerate(("kitchen", "bathroom"))
)
BENCHMARK = Benchmark.of(ROOMS, "val", 20)


def encoded(config: RunConfig) -> list[RoomViews]:
    """Give the rooms feature grids of the size that a run's policy takes."""
    grid = config.policy.grid
    return [
        replace(views, features=np.zeros((views.graph.views, CHANNELS, grid, grid), dtype=np.float16))
        for views in ROOMS
    ]


def test_the_trace_of_a_shortest_path_leads_from_the_start_to_a_success() -> None:
    traces = trace_episodes(OracleAgent(list(ROOMS)), ROOMS, BENCHMARK.episodes, seed=0)
    assert len(traces) == len(BENCHMARK.episodes)
    for episode, trace in zip(BENCHMARK.episodes, traces, strict=True):
        room = next(views for views in ROOMS if views.room == episode.room)
        assert trace.views[0] == episode.start
        assert len(trace.views) == trace.result.actions + 1 == episode.optimal + 2
        assert room.success[trace.views[-1], episode.target]
        assert trace.plan is None


def test_a_trace_holds_what_was_done_at_each_view_and_tracing_changes_no_result() -> None:
    ended: list[int] = []
    traces = trace_episodes(RandomAgent(), ROOMS, BENCHMARK.episodes, 3, ended.append)
    (trial,) = BENCHMARK.run(RandomAgent(), [3]).trials
    assert tuple(trace.result for trace in traces) == trial
    assert ended == sorted(ended)
    assert ended[-1] == len(traces)
    for trace in traces:
        transitions = next(views for views in ROOMS if views.room == trace.result.room).graph.transitions
        assert len(trace.actions) == trace.result.actions
        assert (transitions[trace.views[:-1], trace.actions] == trace.views[1:]).all()
        assert (trace.actions == Action.MOVE_AHEAD).sum() == trace.result.moves


def test_the_plan_of_a_guided_agent_is_that_of_the_graphs() -> None:
    config = RunConfig(method="hoz", channels=CHANNELS)
    graphs = {scene: random_scene_graph(scene=scene) for scene in ("kitchen", "bathroom")}
    agent = load_agent(config, initial_parameters(config.policy, config.seed), graphs)
    for trace in trace_episodes(agent, encoded(config), BENCHMARK.episodes, seed=0):
        plan = trace.plan
        assert plan is not None
        bag = next(views for views in ROOMS if views.room == trace.result.room).bag[trace.views[0]]
        assert plan.current[0] == current_zone(graphs[SCENES[plan.scene[0]]].nodes, bag)
        for step in range(trace.result.actions):
            scene, current, target, subgoal = (int(part[step]) for part in plan)
            hops = next_hops(graphs[SCENES[scene]].edges, config.edge_cost)
            assert subgoal == hops[current, target]
        assert all(len(part) == trace.result.actions for part in plan)
        assert all(part.dtype == np.int16 for part in plan)


@pytest.mark.parametrize("method", ["a3c", "object"])
def test_an_agent_without_zones_has_no_plan(method: str) -> None:
    config = RunConfig(method=method, channels=CHANNELS)  # type: ignore[arg-type] # a parameter is a plain str
    agent = load_agent(config, initial_parameters(config.policy, config.seed), {})
    traces = trace_episodes(agent, encoded(config), BENCHMARK.episodes[:3], seed=0)
    assert [trace.plan for trace in traces] == [None] * 3
