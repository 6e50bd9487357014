import json
from dataclasses import replace

import numpy as np
import pytest

from hoz_dist.errors import HozError
from hoz_dist.reproduce.markdown import aligned, table_text
from hoz_dist.reproduce.outcome import Outcome
from hoz_dist.reproduce.plot import table_figure
from hoz_dist.reproduce.row import Figures, Paper, Row
from hoz_dist.reproduce.summary import summarise
from hoz_dist.viz.zones import png
from tests.unit.reproduce.making import TABLE, TINY, make_outcome


@pytest.fixture
def outcomes() -> dict[str, dict[int, Outcome]]:
    return {
        "random": {0: make_outcome(9, skill=0.1)},
        "object": {seed: make_outcome(20 + seed, skill=0.5) for seed in range(2)},
        "hoz": {seed: make_outcome(seed, skill=0.8) for seed in range(2)},
    }


def test_means_and_deviations_are_of_all_trials_of_all_seeds(outcomes: dict[str, dict[int, Outcome]]) -> None:
    spread = summarise(outcomes, ["hoz"])["hoz"].spreads["all"]["sr"]
    trials = np.array([outcome.success.mean(axis=1) for outcome in outcomes["hoz"].values()]) * 100
    assert spread.mean == pytest.approx(trials.mean())
    assert spread.of_trials == pytest.approx(trials.std(ddof=1))
    assert spread.of_seeds == pytest.approx(trials.mean(axis=1).std(ddof=1))


def test_differences_are_from_the_references_that_there_are(outcomes: dict[str, dict[int, Outcome]]) -> None:
    summaries = summarise(outcomes, ["hoz", "a3c"])
    assert summaries["hoz"].differences == {}
    interval = summaries["object"].differences["hoz"]["long"]["sr"]
    long = outcomes["hoz"][0].long
    means = [np.mean([one.success[:, long].mean() for one in outcomes[name].values()]) for name in ("object", "hoz")]
    assert interval.difference == pytest.approx(100 * (means[0] - means[1]), abs=1e-3)
    assert interval.low < interval.difference < interval.high


def test_scenes_are_told_apart(outcomes: dict[str, dict[int, Outcome]]) -> None:
    of_scenes = summarise(outcomes, [])["random"].by_scene
    assert list(of_scenes) == ["kitchen", "bathroom"]
    kitchen = outcomes["random"][0].success[:, outcomes["random"][0].scene == "kitchen"]
    assert of_scenes["kitchen"]["sr"] == pytest.approx(100 * kitchen.mean())


def test_outcomes_of_other_episodes_are_not_compared(outcomes: dict[str, dict[int, Outcome]]) -> None:
    one = outcomes["hoz"][0]
    outcomes["hoz"][1] = replace(one, optimal=one.optimal + 1)
    with pytest.raises(HozError, match="'hoz' with seed 1 are of different episodes"):
        summarise(outcomes, ["hoz"])


def test_episodes_that_are_all_short_have_no_long_part() -> None:
    short = make_outcome()
    short = replace(short, optimal=np.minimum(short.optimal, 4))
    summaries = summarise({"hoz": {0: short}}, ["hoz"])
    assert list(summaries["hoz"].spreads) == ["all"]
    assert table_text(TABLE, TINY, summaries, "command", {}).endswith("|        - |         - |         - |\n")
    assert png(table_figure(TABLE, summaries)).startswith(b"\x89PNG")


def test_markdown_has_rows_intervals_and_the_papers_figures(outcomes: dict[str, dict[int, Outcome]]) -> None:
    paper = Paper(Figures(57.35, 33.78, 19.02))
    table = replace(TABLE, rows=(replace(TABLE.rows[0], paper=paper), *TABLE.rows[1:]), alike=True)
    summaries = summarise(outcomes, table.references)
    text = table_text(table, TINY, summaries, "hoz-dist reproduce some", {})
    lines = text.splitlines()
    assert lines[0] == "# Some rows"
    row = next(line for line in lines if line.startswith("| random"))
    assert "57.35/33.78/19.02" in row
    spread = summaries["random"].spreads["all"]["sr"]
    assert f"{spread.mean:.1f} ± {spread.of_trials:.1f}" in row  # it has no seeds
    assert spread.of_seeds is None
    spread = summaries["hoz"].spreads["all"]["sr"]
    assert f"{spread.mean:.1f} ± {spread.of_seeds:.1f}" in next(line for line in lines if line.startswith("| hoz"))
    interval = summaries["object"].differences["hoz"]["all"]["sr"]
    assert f"{interval.difference:+.1f} [{interval.low:+.1f}, {interval.high:+.1f}]" in text
    assert "†" not in text  # of random, which is not trained, one seed is all
    assert "Unfinished" not in text
    assert "over the 2 rows other than the reference" in text
    assert "other order" not in text
    json.dumps({name: summary.to_json() for name, summary in summaries.items()}, allow_nan=False)
    assert png(table_figure(table, summaries)).startswith(b"\x89PNG")


def test_comparisons_of_one_training_are_told(outcomes: dict[str, dict[int, Outcome]]) -> None:
    del outcomes["object"][1]
    text = table_text(TABLE, TINY, summarise(outcomes, TABLE.references), "command", {})
    assert "- SR of episodes with L* >= 5, against hoz: of one seed, so not judged: `object`." in text
    assert "| object † |" in text
    by_scene = text.split("By scene and L*")[1]
    assert by_scene.count("| object † |") == 2  # of SR and SPL
    assert "† One seed" in text


def test_rows_are_judged_by_their_intervals_and_baselines_are_not() -> None:
    skills, references = {"random": 0.1, "object": 0.5, "hoz": 0.9}, ("hoz", "object")
    outcomes = {
        name: {seed: make_outcome(10 * number + seed, skill=skill) for seed in range(5)}
        for number, (name, skill) in enumerate(skills.items())
    }
    outcomes |= {"same": outcomes["object"], "near": {seed: make_outcome(50 + seed, skill=0.5) for seed in range(5)}}
    rows = (*TABLE.rows, Row(name="same", agent="object"), Row(name="near", agent="object"))
    table = replace(TABLE, rows=rows, references=references)
    agents = {name: "object" if name == "same" else name for name in outcomes}
    text = table_text(table, TINY, summarise(outcomes, references, agents), "command", {})
    judged = "better: `hoz`; alike within 2 points: `same`; not told apart: `near`."
    assert f"- SR of episodes with L* >= 5, against object: {judged}" in text
    assert "against hoz: worse: `object`, `same`, `near`." in text


def test_the_same_agents_are_compared_seed_by_seed_and_others_are_not() -> None:
    # Both rows have the same results, so that the same agents differ by nothing, and other ones by how much seeds vary.
    both = {seed: make_outcome(seed, skill=skill) for seed, skill in enumerate((0.3, 0.6, 0.9))}
    rows = {"hoz": both, "object": dict(both)}
    same = summarise(rows, ["hoz"], {"hoz": "a", "object": "a"})["object"].differences["hoz"]["all"]["sr"]
    assert (same.low, same.high) == (0.0, 0.0)
    for agents in ({"hoz": "a", "object": "b"}, None):
        apart = summarise(rows, ["hoz"], agents)["object"].differences["hoz"]["all"]["sr"]
        assert apart.low < -10
        assert apart.high > 10


def test_the_same_agents_of_other_seeds_are_not_paired() -> None:
    both = {seed: make_outcome(seed, skill=skill) for seed, skill in enumerate((0.3, 0.6, 0.9))}
    others = {seed + 1: outcome for seed, outcome in both.items()}
    rows = {"hoz": both, "object": others}
    interval = summarise(rows, ["hoz"], {"hoz": "a", "object": "a"})["object"].differences["hoz"]["all"]["sr"]
    assert interval.low < -10


def test_rows_are_compared_with_the_first_reference_by_scene_and_length(
    outcomes: dict[str, dict[int, Outcome]],
) -> None:
    summaries = summarise(outcomes, ["object", "hoz"])
    where = summaries["hoz"].where
    first = outcomes["hoz"][0]
    assert list(where) == ["kitchen", "bathroom", "L* 1-4", "L* 5-9"]
    assert (first.optimal >= 10).sum() in range(1, 20)  # too few to say anything of them
    assert summaries["object"].where == {}
    masks = {"bathroom": first.scene == "bathroom", "L* 5-9": (first.optimal >= 5) & (first.optimal < 10)}
    for name, mask in masks.items():
        means = [np.mean([one.success[:, mask].mean() for one in outcomes[row].values()]) for row in ("hoz", "object")]
        assert where[name]["sr"].difference == pytest.approx(100 * (means[0] - means[1]), abs=1e-3)
    table = replace(TABLE, references=("object", "hoz"))
    text = table_text(table, TINY, summaries, "command", {})
    interval = where["bathroom"]["spl"]
    line = next(line for line in text.split("| SPL |")[1].splitlines() if line.startswith("| hoz "))
    assert f"{interval.difference:+.1f} [{interval.low:+.1f}, {interval.high:+.1f}]" in line
    assert "| random" not in text.split("By scene and L*")[1].split("## Differences from hoz")[0]


def test_outcomes_of_one_scene_are_not_divided_by_scene() -> None:
    one = replace(make_outcome(), rooms=("kitchen/26", "kitchen/27"))
    where = summarise({"hoz": {0: one}, "object": {0: one}}, ["hoz"])["object"].where
    assert all(name.startswith("L* ") for name in where)


def test_an_unfinished_table_says_what_it_lacks(outcomes: dict[str, dict[int, Outcome]]) -> None:
    summaries = summarise({"hoz": outcomes["hoz"]}, ["hoz"])
    lacking = {"hoz": (2, 3), "other order": (0, 3), "random": (0, 1)}
    lines = table_text(TABLE, TINY, summaries, "command", lacking).splitlines()
    assert lines[2] == "Unfinished: random untested, other order 0 of 3 seeds, hoz 2 of 3 seeds."


def test_a_table_without_results_says_so() -> None:
    assert "No results yet." in table_text(TABLE, TINY, summarise({"hoz": {}}, ["hoz"]), "command", {"hoz": (0, 3)})


def test_columns_of_markdown_are_aligned() -> None:
    assert aligned(["row", "SR"], [["a", "1.0"], ["longer", "10.0"]]) == [
        "| row    |   SR |",
        "| :----- | ---: |",
        "| a      |  1.0 |",
        "| longer | 10.0 |",
    ]
