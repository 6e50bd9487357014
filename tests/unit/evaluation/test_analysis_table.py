import io

from rich.console import Console

from hoz_dist.evaluation.analysis import Analysis
from hoz_dist.evaluation.analysis_table import analysis_table
from hoz_dist.evaluation.learning_curve import LearningCurve
from tests.unit.evaluation.making import analysed, zone_plan

PLAIN = Analysis("a3c", ((analysed("AAAAX"), analysed("RLADUAAARLX"), analysed("AAX"), analysed("RRRR")),))
GUIDED = Analysis("hoz", ((analysed("AAX", plan=zone_plan("012", "122", "222")),),))


def lines_of(*analyses: Analysis, curves: dict[str, list[LearningCurve]]) -> dict[str, list[str]]:
    """Return the cells of each row by its label."""
    printed = io.StringIO()
    Console(width=200, file=printed).print(analysis_table(analyses, curves, "title", "caption"))
    rows = [line.strip("│ ").split("│") for line in printed.getvalue().splitlines() if line.startswith("│")]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows}


def test_methods_stand_side_by_side() -> None:
    curves = {"a3c": [LearningCurve((1_000_000,), (60.0,)), LearningCurve((1_000_000,), (40.0,))]}
    rows = lines_of(PLAIN, GUIDED, curves=curves)
    assert rows["success"] == ["50.0", "0.0"]
    assert rows["wrong Done: in view, too far"] == ["25.0", "100.0"]
    assert rows["SPL"] == ["35.0", "0.0"]
    assert rows["lost in search, successes"] == ["5.0", "0.0"]
    assert rows["shortest path after first sight"] == ["75.0 / 66.7", "100.0 / 100.0"]
    assert rows["actions after, successes (least)"] == ["5.0 (3.0)", "-"]
    assert rows["search: turns"] == ["66.7", "0.0"]
    assert rows["sub-goals reached, of those left"] == ["-", "100.0"]
    assert rows["L* 1-4 (4 episodes)"][0].startswith("50.0 [")
    assert rows["SR 50, each run"] == ["0.83 M, not reached", "-"]


def test_what_no_method_has_is_left_out() -> None:
    rows = lines_of(PLAIN, curves={})
    assert "zones, of actions" not in rows
    assert "frames to a success rate" not in rows
