import torch

from hoz_dist.policy.navigator import initial_zone_state
from hoz_dist.policy.state import State
from learner.rollout_states import Ended, RolloutStates
from tests.wire_samples import gradient_push


def ended(sequence: int, incarnation: int = 1, cells: int = 4) -> Ended:
    state = State(torch.zeros(2, 1, 3, cells), initial_zone_state(3, 2))
    return Ended(incarnation, sequence, state, torch.ones(3, dtype=torch.bool))


def test_only_the_rollout_that_follows_begins_with_it() -> None:
    states = RolloutStates()
    last = ended(4)
    states.keep("a", last)
    assert states.before("a", 1, 5) is last
    assert states.before("a", 1, 6) is None
    assert states.before("a", 2, 5) is None
    assert states.before("b", 1, 5) is None
    states.keep("a", ended(0, incarnation=2))
    assert states.before("a", 1, 5) is None
    assert states.before("a", 2, 1) is not None
    assert len(states) == 1


def test_those_that_pushed_longest_ago_are_forgotten() -> None:
    by_number = RolloutStates(most=2)
    by_bytes = RolloutStates(most_bytes=2 * ended(0).size)
    for states in (by_number, by_bytes):
        for name in ("a", "b", "a", "c"):
            states.keep(name, ended(0))
        assert [states.before(name, 1, 1) is not None for name in "abc"] == [True, False, True]
        assert len(states) == 2


def test_one_that_is_too_large_is_kept_alone() -> None:
    states = RolloutStates(most_bytes=ended(0).size)
    states.keep("a", ended(0))
    states.keep("b", ended(0, cells=400))
    assert states.before("b", 1, 1) is not None
    assert len(states) == 1
    states.clear()
    states.keep("a", ended(0))
    assert len(states) == 1


def test_what_is_kept_is_in_memory_of_its_own() -> None:
    parts = torch.zeros(20, 2, 1, 3, 4)
    seen = torch.ones(20, 3, dtype=torch.bool)
    state = State(parts[-1], initial_zone_state(3, 2), target_seen=seen[-1])
    kept = Ended.after(gradient_push(), state, torch.ones(5, 3, dtype=torch.bool)[-1])
    assert kept.state.lstm.untyped_storage().nbytes() == kept.state.lstm.numel() * 4
    assert kept.known.untyped_storage().nbytes() == 3
    assert kept.state.target_seen.tolist() == [True] * 3
    assert kept.state.target_seen.untyped_storage().nbytes() == 3
    assert kept.size == sum(part.nbytes for part in (*state.zone, state.lstm, state.target_seen, kept.known))
