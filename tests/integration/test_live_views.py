"""Stored views tell the truth: an agent that acts in PyBullet itself meets the same episodes."""

from pathlib import Path

import numpy as np
import pytest

from hoz_dist.nav.rooms import RoomId
from hoz_dist.sim.batch_env import BatchEnv
from hoz_dist.sim.live import LiveViews
from hoz_dist.sim.view_store import ViewStore
from tests.integration.seeing import SIDE, TinyEncoder

pytestmark = pytest.mark.integration

ROOMS = (RoomId("bathroom", 1), RoomId("bathroom", 3))


def test_stored_and_live_episodes_are_the_same(cache: Path) -> None:
    """Observations, rewards and ends agree over random actions in two rooms of the catalogue."""
    store = ViewStore(cache, SIDE)
    rooms = [store.open(room, TinyEncoder()) for room in ROOMS]
    batch, cap = 6, 12
    with LiveViews(TinyEncoder(), SIDE) as source:
        stored = BatchEnv(batch, np.random.default_rng(3), cap)
        live = BatchEnv(batch, np.random.default_rng(3), cap, source=source)
        for views in rooms:
            stored.add_room(views)
            live.add_room(views)
        rng = np.random.default_rng(4)
        successes, ended = 0, 0
        for _ in range(60):
            expected, actual = stored.observe(), live.observe()
            for name, array in actual._asdict().items():
                assert np.array_equal(array, expected._asdict()[name]), name
            actions = rng.choice(6, size=batch, p=[0.3, 0.2, 0.15, 0.1, 0.1, 0.15])
            # Nobody succeeds often by chance: say Done wherever the store says that it would succeed.
            numbers = (stored.views >= rooms[0].graph.views).astype(int)
            for slot, (number, view) in enumerate(zip(numbers, stored.views, strict=True)):
                local = view - number * rooms[0].graph.views
                if rooms[number].success[local, expected.target[slot]] and rng.random() < 0.5:
                    actions[slot] = 5
            step, live_step = stored.step(actions), live.step(actions)
            for one, other in zip(step[:4], live_step[:4], strict=True):
                assert np.array_equal(one, other)
            assert step.finished == live_step.finished
            successes += sum(result.success for result in step.finished)
            ended += len(step.finished)
        assert 0 < successes < ended
