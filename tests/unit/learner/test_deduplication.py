import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from learner.deduplication import MAX_SENDERS, WINDOW, SeenPushes, Sender

ALICE = Sender("gradient", "alice", 7)


def test_a_push_is_seen_once_it_was_taken() -> None:
    seen = SeenPushes()
    assert (ALICE, 0) not in seen
    seen.add(ALICE, 0)
    assert (ALICE, 0) in seen
    assert (ALICE, 1) not in seen


@pytest.mark.parametrize(
    "other", [Sender("gradient", "bob", 7), Sender("gradient", "alice", 8), Sender("episodes", "alice", 7)]
)
def test_senders_are_told_apart(other: Sender) -> None:
    seen = SeenPushes()
    seen.add(ALICE, 3)
    assert (other, 3) not in seen


@given(st.permutations(range(WINDOW)), st.integers(0, WINDOW - 1))
def test_within_the_window_order_does_not_matter(order: list[int], count: int) -> None:
    seen = SeenPushes()
    for sequence in order[:count]:
        seen.add(ALICE, sequence)
    assert {sequence for sequence in range(WINDOW) if (ALICE, sequence) in seen} == set(order[:count])


def test_what_is_older_than_the_window_counts_as_seen() -> None:
    seen = SeenPushes()
    seen.add(ALICE, 1000)
    assert (ALICE, 1000 - WINDOW) in seen
    assert (ALICE, 1001 - WINDOW) not in seen


def test_the_sender_that_was_silent_longest_is_forgotten_first() -> None:
    seen = SeenPushes()
    for incarnation in range(MAX_SENDERS):
        seen.add(Sender("gradient", "alice", incarnation), 0)
    seen.add(Sender("gradient", "alice", 0), 1)
    seen.add(Sender("gradient", "alice", MAX_SENDERS), 0)
    assert len(seen.rows()) == MAX_SENDERS
    assert (Sender("gradient", "alice", 0), 0) in seen
    assert (Sender("gradient", "alice", 1), 0) not in seen


def test_an_actor_that_invents_incarnations_pushes_out_only_its_own() -> None:
    seen = SeenPushes()
    bob = Sender("gradient", "bob", 1)
    seen.add(bob, 0)
    for incarnation in range(2 * MAX_SENDERS):
        seen.add(Sender("gradient", "mallory", incarnation), 0)
    assert len(seen.rows()) == MAX_SENDERS
    assert (bob, 0) in seen


def test_the_table_survives_json() -> None:
    seen = SeenPushes()
    for sequence in (1, 2, 5, 2**40):
        seen.add(ALICE, sequence)
    seen.add(Sender("room", "bob", 2**62), 9)
    again = SeenPushes(json.loads(json.dumps(seen.rows())))
    assert again.rows() == seen.rows()
    assert (ALICE, 2**40) in again


def test_something_else_than_a_table_is_refused() -> None:
    with pytest.raises(ValueError, match="not a row"):
        SeenPushes([["gradient", "alice"]])
