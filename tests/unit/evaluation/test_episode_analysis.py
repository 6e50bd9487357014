import json

import numpy as np
import pytest

from hoz_dist.evaluation.agents import OracleAgent, RandomAgent
from hoz_dist.evaluation.benchmark import Benchmark
from hoz_dist.evaluation.episode_analysis import (
    NEVER,
    Cause,
    EpisodeAnalysis,
    Kinds,
    ZoneUse,
    analyse_episodes,
    zone_use,
)
from hoz_dist.evaluation.trace import trace_episodes
from hoz_dist.nav.metrics import spl_of
from tests.unit.evaluation.making import NEAR, TARGET, analysed, corridor, traced, zone_plan


@pytest.mark.parametrize(
    ("letters", "cause"),
    [
        ("AAAAX", Cause.SUCCESS),
        ("AAX", Cause.WRONG_DONE_FAR),
        ("ARX", Cause.WRONG_DONE_UNSEEN),  # it was seen before, but is not in view
        ("X", Cause.WRONG_DONE_UNSEEN),  # it was never seen
        ("AAAARX", Cause.WRONG_DONE_UNSEEN),  # Done would have succeeded one action earlier
        ("AAAAR", Cause.TIME_OUT_AT_TARGET),
        ("AAA", Cause.LOST),
        ("AAAA", Cause.LOST),  # it is at the target only when nothing can be said any more
        ("RRR", Cause.NEVER_SEEN),
        ("DA", Cause.NEVER_SEEN),  # it looks down
    ],
)
def test_an_episode_has_one_cause(letters: str, cause: Cause) -> None:
    assert analysed(letters).cause is cause


def test_search_and_approach_are_cut_at_the_first_sight() -> None:
    # Turns back and forth, is blocked once, walks on, looks down and up, dawdles at the target.
    episode = analysed("RALADUAARLX")
    assert episode.length == 10
    assert (episode.seen_after, episode.seen_optimal) == (4, 1)
    assert episode.search == Kinds(moves=1, blocked=1, turns=2, looks=0)
    assert episode.approach == Kinds(moves=2, blocked=0, turns=2, looks=2)
    assert episode.approach_optimal == 3


def test_excess_actions_are_those_of_search_approach_and_done() -> None:
    episode = analysed("RLADUAAARLX")
    assert episode.optimal == 4
    assert (episode.search_excess, episode.approach_excess, episode.done_excess) == (2, 2, 2)
    assert episode.length == 10
    assert episode.spl == 0.4


def test_what_did_not_happen_is_never() -> None:
    episode = analysed("RR")
    assert (episode.seen_after, episode.approach_optimal, episode.reached_after) == (NEVER, NEVER, NEVER)
    assert episode.search == Kinds(turns=2)
    assert episode.approach == Kinds()
    assert analysed("AA").reached_after == NEVER


def test_a_target_in_view_at_the_start_is_not_searched() -> None:
    episode = analysed("AAX", z=NEAR - 2)
    assert (episode.seen_after, episode.seen_optimal, episode.approach_optimal) == (0, 0, 2)
    assert episode.search == Kinds()


def test_revisits_are_actions_to_a_known_view() -> None:
    assert analysed("AAAAX").revisits == 0
    assert analysed("RLAX").revisits == 1
    assert analysed("RAALX").revisits == 3  # two blocked moves, and back at the start
    assert analysed("L" * 8).revisits == 1


def test_excesses_and_spl_agree_with_the_results_of_any_agent() -> None:
    room = corridor()
    benchmark = Benchmark.of([room], "val", 200)
    for agent in (RandomAgent(), OracleAgent([room])):
        traces = trace_episodes(agent, [room], benchmark.episodes, seed=1)
        episodes = list(analyse_episodes(traces, [room]))
        successes = 0
        for trace, episode in zip(traces, episodes, strict=True):
            assert episode.success == trace.result.success
            assert episode.spl == spl_of(trace.result)
            assert sum(episode.search) + sum(episode.approach) == episode.length
            if episode.success:
                excesses = (episode.search_excess, episode.approach_excess, episode.done_excess)
                assert min(excesses) >= 0
                assert sum(excesses) == episode.length - episode.optimal
                assert agent.name == "random" or sum(excesses) == 0
                successes += 1
        assert successes > 0


def test_zones_that_guide() -> None:
    # Zone 1 is set, kept and reached; 3 is set and given up for 5, where the agent is already; it leaves, and ends.
    use = zone_use(zone_plan(current="0012452", subgoal="1133355", target="5555555"), scene=0)
    assert use == ZoneUse(
        steps=7, right_scene=7, subgoal_differs=5, in_target_zone=1, subgoals=3, reached=1, unsettled=1
    )


@pytest.mark.parametrize(
    ("plan", "subgoals", "reached", "unsettled"),
    [
        (zone_plan("00", "11", "11"), 1, 0, 1),
        (zone_plan("01", "11", "11"), 1, 1, 0),
        (zone_plan("012", "122", "222"), 2, 2, 0),  # each is reached as the next one is set
        (zone_plan("00", "12", "22"), 2, 0, 1),
        (zone_plan("11", "11", "11"), 0, 0, 0),  # in the target zone: nowhere to go
        (zone_plan("101", "111", "111"), 1, 1, 0),  # leaves it and comes back
        (zone_plan("01", "11", "11", scene="02"), 1, 0, 0),  # zone 1 of another graph is another zone
    ],
)
def test_a_sub_goal_is_reached_changed_or_open(plan: object, subgoals: int, reached: int, unsettled: int) -> None:
    use = zone_use(plan, scene=0)  # type: ignore[arg-type] # pytest's parameters have no types
    assert (use.subgoals, use.reached, use.unsettled) == (subgoals, reached, unsettled)


def test_the_right_scene_is_that_of_the_room() -> None:
    episode = analysed("AAX", plan=zone_plan("000", "000", "000", scene="011"))
    assert episode.zones is not None
    assert episode.zones.right_scene == 1  # kitchen is scene 0


def test_json_and_back() -> None:
    for episode in (analysed("AAX", plan=zone_plan("010", "111", "111")), analysed("RR")):
        assert EpisodeAnalysis.from_json(json.loads(json.dumps(episode))) == episode


def test_the_corridor_is_what_it_says() -> None:
    room = corridor()
    assert room.bag[:, TARGET].sum() == 6
    assert (room.success[:, TARGET] <= room.bag[:, TARGET]).all()
    assert room.optimal[traced("").views[0], TARGET] == NEAR
    assert np.isin(traced("AAAA").views[-1], np.flatnonzero(room.success[:, TARGET]))
