"""Rollouts by pose ids: small, and of steps that can follow each other."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.codec import decode, encode
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.trajectories import (
    FRAME_BYTES,
    Flag,
    GraphUsed,
    RoomUsed,
    Steps,
    TrajectoryPush,
    most_bytes,
)
from tests.wire_samples import steps_of, trajectory_push

MOST_PER_FRAME = 100
"""What issue 4 allows, bytes."""


@pytest.mark.parametrize(("batch", "steps", "rooms"), [(64, 20, 1), (64, 20, 20), (16, 20, 16)])
def test_a_frame_takes_some_twenty_bytes_whatever_the_policy_and_the_pictures(
    batch: int, steps: int, rooms: int
) -> None:
    push = trajectory_push(steps_of((steps, batch), rooms), rooms)
    size = len(encode(push))
    assert size / (batch * steps) < 25
    assert size / push.frames < 30 < MOST_PER_FRAME
    assert size <= most_bytes(batch, steps)
    assert size >= (FRAME_BYTES - 1) * batch * steps


def test_the_document_says_how_large_a_rollout_is_and_what_the_flags_are() -> None:
    document = (Path(__file__).parents[3] / "docs" / "wire-protocol.md").read_text(encoding="utf-8")
    text = document.partition("### trajectory\n")[2].partition("\n### ")[0]
    assert f"At most {FRAME_BYTES} B (T + 1) bytes" in text
    told = re.findall(r"(\d+): ", text[text.index("sum of") : text.index("`scene`, `current`")])
    assert told == [str(int(flag)) for flag in Flag]


def test_values_arrive_as_they_were() -> None:
    push = trajectory_push(steps_of((6, 5), rooms=2, seed=3), rooms=2)
    found = decode(encode(push), TrajectoryPush)
    assert found.rooms[1].room == RoomId("kitchen", 2)
    assert found.graphs[0].version == 2
    assert found.frames == push.frames < 30
    for name in Steps.SPECS:
        np.testing.assert_array_equal(getattr(found.steps, name), getattr(push.steps, name), err_msg=name)


def test_rooms_graphs_and_indices_belong_together() -> None:
    push = trajectory_push()
    room, graph = push.rooms[0], push.graphs[0]
    cases: list[tuple[dict[str, Any], Reason]] = [
        ({"rooms": (room, room)}, Reason.NAME),
        ({"graphs": (graph, GraphUsed("kitchen", 1, 3))}, Reason.NAME),
        ({"rooms": ()}, Reason.RANGE),
        ({"steps": replace(push.steps, flags=push.steps.flags & ~np.uint8(Flag.FRESH))}, Reason.RANGE),
    ]
    for fields, reason in cases:
        with pytest.raises(RejectedError) as caught:
            replace(push, **fields)
        assert caught.value.reason == reason
    with pytest.raises(RejectedError) as caught:
        RoomUsed(RoomId("kitchen", 21), "d1")
    assert caught.value.reason == Reason.SPLIT
    replace(push, graphs=(), steps=replace(push.steps, flags=push.steps.flags & ~np.uint8(Flag.FRESH)))


def flags_with(steps: Steps, row: int, more: int = 0, less: int = 0) -> np.ndarray:
    flags = steps.flags.copy()
    flags[row, 0] = (flags[row, 0] | np.uint8(more)) & ~np.uint8(less)
    return flags


def test_steps_that_cannot_follow_each_other_are_refused() -> None:
    steps = steps_of((6, 2), seed=1)
    moves = replace(steps, action=np.zeros_like(steps.action), flags=flags_of(6, 2))
    done = moves.action.copy()
    done[3, 0] = 5
    other = moves.target.copy()
    other[3:, 0] = 2
    cases: dict[str, Callable[[], Steps]] = {
        "the row after": lambda: replace(moves, flags=flags_with(moves, 6, Flag.VALID)),
        "terminated by Done alone": lambda: replace(moves, flags=flags_with(moves, 3, Flag.TERMINATED)),
        "Done alone": lambda: replace(moves, action=np.full_like(moves.action, 5)),
        "both": lambda: replace(moves, action=done, flags=flags_with(moves, 3, Flag.TERMINATED | Flag.TRUNCATED)),
        "not taken just if": lambda: replace(moves, flags=flags_with(moves, 3, Flag.TRUNCATED)),
        "at a step that was not taken": lambda: replace(moves, flags=flags_with(moves, 3, Flag.TRUNCATED, Flag.VALID)),
        "begins just after": lambda: replace(moves, flags=flags_with(moves, 3, Flag.FIRST)),
        "first step of an episode is not taken": lambda: replace(moves, flags=with_reset_first(moves)),
        "previous action": lambda: replace(moves, previous_action=np.zeros_like(moves.previous_action)),
        "changes within": lambda: replace(moves, target=other),
    }
    for detail, make in cases.items():
        with pytest.raises(RejectedError, match=detail) as caught:
            make()
        assert caught.value.reason == Reason.RANGE


def flags_of(steps: int, batch: int) -> np.ndarray:
    """Of episodes that begin with the first step and go on."""
    flags = np.full((steps + 1, batch), int(Flag.VALID), np.uint8)
    flags[0] |= np.uint8(Flag.FIRST | Flag.FRESH)
    flags[-1] = 0
    return flags


def with_reset_first(steps: Steps) -> np.ndarray:
    """Of an episode whose first step only begins it."""
    flags = steps.flags.copy()
    flags[0] &= ~np.uint8(Flag.VALID)
    flags[1] |= np.uint8(Flag.FIRST)
    return flags


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("target", 22, Reason.RANGE),
        ("flags", 32, Reason.RANGE),
        ("scene", 5, Reason.RANGE),
        ("current", 64, Reason.RANGE),
        ("subgoal", 64, Reason.RANGE),
        ("previous_action", 9, Reason.RANGE),
        ("action", 6, Reason.RANGE),
        ("reward", 5.1, Reason.RANGE),
        ("reward", -0.02, Reason.RANGE),
        ("reward", np.nan, Reason.NONFINITE),
        ("log_probability", 0.1, Reason.RANGE),
        ("log_probability", -np.inf, Reason.NONFINITE),
    ],
)
def test_every_value_has_its_range(name: str, value: float, reason: Reason) -> None:
    steps = steps_of()
    values = getattr(steps, name).copy()
    values.flat[0] = value
    with pytest.raises(RejectedError) as caught:
        replace(steps, **{name: values})
    assert caught.value.reason == reason


@pytest.mark.parametrize("name", [name for name in Steps.SPECS if name != "action"])
def test_every_tensor_has_the_shape_of_the_actions(name: str) -> None:
    steps = steps_of()
    with pytest.raises(RejectedError) as caught:
        replace(steps, **{name: getattr(steps, name)[1:]})
    assert caught.value.reason == Reason.SHAPE
