"""Gradients that travel compressed, from an actor's link to the parameters of a real learner."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest

from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.config import Compression
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.wire.protocol.answers import Accepted, Refused
from hoz_dist.wire.protocol.pushes import GradientPush
from hoz_dist.wire.transport.session import open_client
from learner.core import LearnerCore
from learner.events import GradientReceived
from tests.integration.learning import CONFIG, DEADLINE_S, gradient_for, running_learner
from workers.link import LearnerLink

pytestmark = pytest.mark.integration


@pytest.mark.parametrize("codec", ["int8", "topk"])
def test_what_a_codec_leaves_of_a_gradient_arrives_with_the_next_one(
    free_port: int, tmp_path: Path, codec: Compression
) -> None:
    config = replace(CONFIG, compress=codec)
    start = initial_parameters(config.policy, config.seed)
    compressor, core = Compressor(codec, start.size, config.gradient_norm), LearnerCore(config, start)
    with (
        running_learner(free_port, tmp_path / "run", config) as endpoint,
        open_client(endpoint, DEADLINE_S) as session,
        LearnerLink(session, "a", None, threading.Event()) as link,
    ):
        parameters = link.parameters()
        for number in range(4):
            gradient = gradient_for(parameters, number)
            if number == 2:  # leaves no trace
                epoch, version = parameters.head.stamp
                assert isinstance(link.push_gradient(gradient, 20, (epoch, version + 9)), Refused)
            accepted = link.push_gradient(gradient, 20, parameters.head.stamp)
            assert isinstance(accepted, Accepted)
            parameters = link.parameters((accepted.epoch, accepted.version))
            push = GradientPush("a", 1, number, 1, number, 20, compressor.compress(gradient, number))
            compressor.accepted()
            core.handle(GradientReceived(0, push), now=0.0)
        assert parameters.vector.tobytes() == core.parameters.tobytes()
