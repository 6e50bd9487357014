import json

import pytest

from hoz_dist.evaluation.analysis import Analysis, causes, phases, spl_budget, what_if, zone_figures
from hoz_dist.evaluation.episode_analysis import Cause
from tests.unit.evaluation.making import analysed, zone_plan

STRAIGHT = analysed("AAAAX")
WINDING = analysed("RLADUAAARLX")
"""L* = 4, L = 10, two actions too many in each part."""
FAR = analysed("AAX")
HESITANT = analysed("AAAARRRR")
BLIND = analysed("RRRR")
MIXED = Analysis("mixed", ((STRAIGHT, WINDING, FAR, HESITANT, BLIND),))


def test_causes_are_exclusive_and_exhaustive() -> None:
    shares = causes(MIXED)
    assert sum(shares.values()) == pytest.approx(100.0)
    assert shares[Cause.SUCCESS] == 40.0
    assert {cause for cause, share in shares.items() if share == 20.0} == {
        Cause.WRONG_DONE_FAR,
        Cause.TIME_OUT_AT_TARGET,
        Cause.NEVER_SEEN,
    }


def test_every_point_of_spl_is_accounted_for() -> None:
    budget = spl_budget(MIXED)
    assert budget.spl == pytest.approx(100 * (1 + 0.4) / 5)
    assert budget.search == budget.approach == budget.late_done == pytest.approx(100 * 0.2 / 5)
    lost = budget.search + budget.approach + budget.late_done + sum(budget.failures.values())
    assert budget.spl + lost == pytest.approx(100.0)


def test_what_would_be_if_one_part_were_perfect() -> None:
    cases = what_if(MIXED)
    assert {name: rates.sr for name, rates in cases.items()} == {
        "as_it_is": 40.0,
        "search": 40.0,
        "approach": 40.0,
        "done": 60.0,  # wins the hesitant one too
        "after_sight": 80.0,  # and the one that stopped too far away
    }
    assert cases["as_it_is"].spl == pytest.approx(28.0)
    assert cases["search"].spl == cases["approach"].spl == pytest.approx(100 * (1 + 4 / 8) / 5)
    assert cases["done"].spl == pytest.approx(100 * (1 + 4 / 8 + 1) / 5)
    assert cases["after_sight"].spl == pytest.approx(100 * (1 + 4 / 6 + 1 + 1) / 5)


def test_search_and_approach_against_the_least() -> None:
    figures = phases(MIXED)
    assert figures.seen == 80.0
    assert figures.search_actions == pytest.approx((1 + 3 + 1 + 1) / 4)
    assert figures.search_optimal == 1.0
    assert figures.success_when_seen == 50.0
    assert figures.approach_actions == pytest.approx((3 + 7) / 2)
    assert figures.approach_optimal == 3.0
    assert figures.done_actions == 1.0
    actions = 4 + 10 + 2 + 8 + 4
    assert figures.actions_after_sight == pytest.approx(100 * (3 + 7 + 1 + 7) / actions)
    assert figures.revisits == pytest.approx(100 * (0 + 3 + 0 + 0 + 0) / actions)
    assert figures.search_kinds == pytest.approx({"moves": 40.0, "blocked": 0.0, "turns": 60.0, "looks": 0.0})
    assert sum(figures.approach_kinds.values()) == pytest.approx(100.0)


def test_an_agent_that_saw_and_won_nothing_has_no_means() -> None:
    figures = phases(Analysis("blind", ((BLIND,),)))
    assert figures.search_actions is figures.approach_actions is figures.success_when_seen is None
    assert figures.seen == figures.actions_after_sight == 0.0


def test_zones_in_percent() -> None:
    assert zone_figures(MIXED) is None
    guided = Analysis(
        "hoz", ((analysed("AAX", plan=zone_plan("012", "122", "222")), analysed("R", plan=zone_plan("0", "1", "2"))),)
    )
    figures = zone_figures(guided)
    assert figures is not None
    assert figures.right_scene == 100.0
    assert (figures.subgoal_differs, figures.in_target_zone) == (50.0, 25.0)
    assert figures.subgoals == 1.5
    assert figures.reached == 100.0  # the third was neither reached nor changed


def test_long_episodes_are_a_part_of_their_own() -> None:
    assert MIXED.long is None
    far = analysed("RLLAAAAX", yaw=45)
    both = Analysis("both", ((STRAIGHT, far), (STRAIGHT, far)))
    assert both.long == Analysis("both", ((far,), (far,)))


def test_all_figures_as_json() -> None:
    figures = json.loads(json.dumps(MIXED.to_json()))
    assert (figures["episodes"], figures["trials"]) == (5, 1)
    assert figures["causes"]["never_seen"] == figures["spl_budget"]["failures"]["never_seen"] == 20.0
    assert figures["what_if"]["done"]["sr"] == 60.0
    assert figures["phases"]["search_kinds"]["turns"] == pytest.approx(60.0)
    assert figures["success_by_length"][0]["episodes"] == 5
    assert figures["zones"] is None
