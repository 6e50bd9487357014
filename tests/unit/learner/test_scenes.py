import dataclasses

import pytest

from hoz_dist.nav.rooms import RoomId
from hoz_dist.wire.protocol.rejection import Reason, RejectedError
from hoz_dist.wire.protocol.trajectories import RoomUsed, TrajectoryPush
from learner.rollout_gradients import RolloutGradients
from tests.unit.workers.making import CONFIG, make_collector

APARTMENT = RoomId("apartment", 1)


def test_rollouts_in_apartments_are_refused_where_the_scene_layer_has_no_output_for_them() -> None:
    trajectory = make_collector().record()
    push = TrajectoryPush("a0", 7, 0, 1, 0, (RoomUsed(APARTMENT, "d1"),), (), trajectory.steps)
    with pytest.raises(RejectedError, match="no output for that of apartment/1") as caught:
        RolloutGradients(CONFIG).missing(push, {"apartment/1"})
    assert caught.value.reason is Reason.RANGE
    of_all_scenes = dataclasses.replace(CONFIG, scenes=5)
    assert RolloutGradients(of_all_scenes).missing(push, {"apartment/1"}) == [APARTMENT]
