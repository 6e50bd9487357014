import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hoz_dist.errors import DamagedFileError
from hoz_dist.evaluation.trials import Evaluation
from hoz_dist.nav.episode import EpisodeResult
from hoz_dist.nav.metrics import long_episodes, metrics_of
from hoz_dist.nav.rooms import RoomId
from hoz_dist.reproduce.outcome import METRICS, Outcome
from tests.unit.reproduce.making import make_outcome


def results_of(outcome: Outcome) -> list[list[EpisodeResult]]:
    """The same results as the rest of the code has them."""
    return [
        [
            EpisodeResult(
                room=RoomId.parse(outcome.rooms[outcome.room[episode]]),
                target=int(outcome.target[episode]),
                success=bool(outcome.success[trial, episode]),
                actions=int(outcome.actions[trial, episode]),
                moves=int(outcome.moves[trial, episode]),
                said_done=bool(outcome.said_done[trial, episode]),
                optimal=int(outcome.optimal[episode]),
            )
            for episode in range(len(outcome.optimal))
        ]
        for trial in range(len(outcome.success))
    ]


def test_metrics_are_those_of_single_episodes() -> None:
    outcome = make_outcome()
    for trial, results in enumerate(results_of(outcome)):
        for metric in METRICS:
            values = outcome.values(metric)[trial]
            assert values.mean() == pytest.approx(getattr(metrics_of(results), metric))
            assert values[outcome.long].mean() == pytest.approx(getattr(metrics_of(long_episodes(results)), metric))


def test_an_evaluation_is_kept_as_it_was(tmp_path: Path) -> None:
    outcome = make_outcome()
    taken = Outcome.of(Evaluation("hoz", "test", tuple(map(tuple, results_of(outcome)))), {"agent": "hoz"})
    path = tmp_path / "new" / "seed-0.json"
    taken.save(path)
    read = Outcome.load(path)
    assert read.same_episodes(outcome)
    assert read.facts == {"agent": "hoz"}
    for name in ("success", "actions", "moves", "said_done"):
        np.testing.assert_array_equal(getattr(read, name), getattr(outcome, name))
    assert read.scene[:2].tolist() == ["kitchen", "bathroom"]


def test_the_same_episodes_are_those_of_the_same_rooms_targets_and_lengths() -> None:
    outcome = make_outcome()
    assert outcome.same_episodes(make_outcome(seed=1, trials=2, skill=0.1))  # whatever came of them
    assert outcome.same_episodes(replace(outcome, facts={}))
    others = (
        {"rooms": ("kitchen/26", "bathroom/28")},
        {"rooms": ("bathroom/27", "kitchen/26")},
        {"rooms": (*outcome.rooms, "bathroom/28")},
        {"room": 1 - outcome.room},
        {"target": (outcome.target + 1) % 22},
        {"optimal": outcome.optimal + 1},
    )
    for change in others:
        other = replace(outcome, **change)
        assert not outcome.same_episodes(other), change
        assert not other.same_episodes(outcome), change
    assert not outcome.same_episodes(make_outcome(episodes=79))


@pytest.mark.parametrize(
    "change",
    [
        {"format": 9},
        {"optimal": [3]},
        {"optimal": [0] * 40},
        {"target": [99] * 40},
        {"rooms": ["kitchen/26"]},
        {"success": "1"},
        {"moves": [[100] * 40] * 3},
        {"moves": [[0] * 40] * 3, "actions": [[0] * 40] * 3},
        {"facts": None, "actions": None},
        {"facts": []},
        {"success": ["x" * 40] * 3},
        {"actions": [[30.7] * 40] * 3},
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(tmp_path: Path, change: dict[str, Any]) -> None:
    path = tmp_path / "seed-0.json"
    path.write_text(json.dumps(make_outcome().to_json() | change))
    with pytest.raises(DamagedFileError, match="delete it"):
        Outcome.load(path)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 1, "facts"'])
def test_what_is_something_else_is_refused_in_one_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "seed-0.json"
    path.write_text(text)
    with pytest.raises(DamagedFileError, match="delete it"):
        Outcome.load(path)
