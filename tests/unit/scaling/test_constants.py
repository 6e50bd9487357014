"""The model's bounds and sizes are those of the wire."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from hoz_dist.a3c.compression.codecs import TOP_SHARE
from hoz_dist.a3c.compression.compressor import Compressor
from hoz_dist.config import Compression, ParametersForm, RunConfig, Source
from hoz_dist.scaling import client, node, sizes
from hoz_dist.scaling.costs import SOURCES
from hoz_dist.scaling.model import most_lag
from hoz_dist.scaling.setting import Setting
from hoz_dist.wire.client import parameters
from hoz_dist.wire.protocol.codec import lay_out
from hoz_dist.wire.protocol.deltas import quantise
from hoz_dist.wire.protocol.parameters import ParametersHead
from hoz_dist.wire.serving import inbox, versions
from hoz_dist.wire.serving.editions import Delta, Full
from tests import wire_samples
from tests.unit.scaling.making import costs

P = 300_000


def test_bounds_are_the_wires() -> None:
    assert node.MOST_WAITING == inbox.MOST_WAITING
    assert node.MOST_WAITING_BYTES == inbox.MOST_WAITING_BYTES
    assert node.LONGEST_WAIT_S == inbox.LONGEST_WAIT_S
    assert node.MOST_READERS == versions.MOST_READERS
    assert node.MOST_VERSION_BYTES == versions.MOST_BYTES
    assert client.UNDER_WAY == parameters.MOST_UNDER_WAY
    assert client.FAST_S == parameters.FAST_S
    assert sizes.TOP_SHARE == TOP_SHARE
    assert Setting(actors=1).max_lag == RunConfig().max_lag


def test_choices_are_those_of_a_run() -> None:
    assert set(SOURCES) == set(get_args(Source))
    assert set(sizes.COMPRESSIONS) == set(get_args(Compression))
    assert set(sizes.PARAMETERS_FORMS) == set(get_args(ParametersForm))


@pytest.mark.parametrize("codec", sizes.COMPRESSIONS)
def test_a_gradient_has_as_many_bytes_as_its_message(codec: Compression) -> None:
    vector = np.random.default_rng(0).normal(size=P).astype(np.float32)
    gradient = Compressor(codec, P, 1000.0).compress(vector, version=100_000)
    message = lay_out(replace(wire_samples.gradient_push(size=10), gradient=gradient))
    assert sizes.gradient_bytes(codec, P) == pytest.approx(message.size, rel=0.03)


def test_a_rollout_has_about_as_many_bytes_as_its_message() -> None:
    config = RunConfig()
    message = wire_samples.trajectory_push(wire_samples.steps_of((config.rollout_steps, config.batch)))
    # The steps that only begin an episode are no frames; they travel all the same.
    assert sizes.rollout_bytes(config.rollout_steps * config.batch) == pytest.approx(lay_out(message).size, rel=0.05)


@pytest.mark.parametrize("form", sizes.PARAMETERS_FORMS)
def test_parameters_have_as_many_parts_and_bytes_as_what_is_served(form: ParametersForm) -> None:
    head, vector = ParametersHead(1, 1, P), np.ones(P, np.float32)
    delta = Delta(head, "0123456789abcdef", renews=False, difference=quantise(vector, np.zeros(P, np.float32)))
    served = Full(head, vector) if form == "full" else delta
    assert sizes.questions(form, P) == served.shards
    assert sizes.parameters_bytes(form, P) == pytest.approx(
        sum(lay_out(served.part(number)).size for number in range(served.shards)), rel=0.01
    )


def test_rollouts_may_lag_as_far_as_the_learner_lets_them() -> None:
    assert most_lag(costs(), Setting(actors=1, max_lag=9)) == 9
    assert most_lag(costs(learn_from="rollouts"), Setting(actors=1, max_lag=9)) == 19
