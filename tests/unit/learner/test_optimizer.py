import sys
from itertools import pairwise

import numpy as np
import pytest
import torch

from learner.optimizer import FlatAdam, lag_weight
from tests.unit.learner.making import vector


def oracle(parameters: list[float], gradients: list[list[float]], rates: list[float]) -> list[float]:
    """Adam as Kingma and Ba's Algorithm 1 states it, one number at a time."""
    theta, m, v = list(parameters), [0.0] * len(parameters), [0.0] * len(parameters)
    for t, (g, alpha) in enumerate(zip(gradients, rates, strict=True), start=1):
        for i in range(len(theta)):
            m[i] = 0.9 * m[i] + 0.1 * g[i]
            v[i] = 0.999 * v[i] + 0.001 * g[i] ** 2
            theta[i] -= alpha * (m[i] / (1 - 0.9**t)) / ((v[i] / (1 - 0.999**t)) ** 0.5 + 1e-8)
    return theta


def test_steps_are_adams() -> None:
    optimizer = FlatAdam(vector(0), learning_rate=0.01)
    gradients = [vector(seed) for seed in range(1, 21)]
    rates = []
    for index, gradient in enumerate(gradients):
        optimizer.set_progress(index / 20)
        rates.append(optimizer.learning_rate)
        optimizer.step(gradient)
    expected = oracle(vector(0).tolist(), [g.tolist() for g in gradients], rates)
    np.testing.assert_allclose(optimizer.parameters, expected, rtol=1e-5, atol=1e-6)


def test_steps_are_those_of_torch_adam() -> None:
    optimizer = FlatAdam(vector(0), learning_rate=0.01)
    reference = torch.from_numpy(vector(0)).requires_grad_()
    adam = torch.optim.Adam([reference], lr=0.01)
    for seed in range(1, 11):
        optimizer.step(vector(seed))
        reference.grad = torch.from_numpy(vector(seed))
        adam.step()
    np.testing.assert_allclose(optimizer.parameters, reference.detach().numpy(), rtol=1e-6, atol=1e-7)


def test_learning_rate_falls_linearly_to_zero() -> None:
    optimizer = FlatAdam(vector(0), learning_rate=0.02)
    rates = []
    for progress in (0.0, 0.25, 0.5, 1.0, 1.5):
        optimizer.set_progress(progress)
        rates.append(optimizer.learning_rate)
    assert rates == pytest.approx([0.02, 0.015, 0.01, 0.0, 0.0])


def test_a_fresh_gradient_counts_fully_and_staler_ones_less_and_less() -> None:
    assert lag_weight(0) == 1.0
    weights = [lag_weight(lag) for lag in range(33)]
    assert all(later < earlier for earlier, later in pairwise(weights))
    assert lag_weight(3) == pytest.approx(0.5)


def test_the_gradient_of_a_message_is_left_alone_and_let_go() -> None:
    message = vector(1).tobytes()  # read-only, as what is received
    references = sys.getrefcount(message)
    optimizer = FlatAdam(vector(0), learning_rate=0.01)
    for _ in range(3):
        optimizer.step(np.frombuffer(message, dtype=np.float32))
    assert message == vector(1).tobytes()
    assert sys.getrefcount(message) == references


def test_the_callers_parameters_are_left_alone_and_ours_cannot_be_written() -> None:
    initial = vector(0)
    optimizer = FlatAdam(initial, learning_rate=0.01)
    optimizer.step(vector(1))
    np.testing.assert_array_equal(initial, vector(0))
    with pytest.raises(ValueError, match="read-only"):
        optimizer.parameters[0] = 1.0


def test_continuing_from_saved_moments_is_as_if_never_interrupted() -> None:
    straight = FlatAdam(vector(0), learning_rate=0.01)
    for seed in range(1, 6):
        straight.step(vector(seed))
    resumed = FlatAdam(straight.parameters, learning_rate=0.01)
    resumed.load_state(straight.state())
    for seed in range(6, 11):
        for optimizer in (straight, resumed):
            optimizer.step(vector(seed))
    np.testing.assert_array_equal(resumed.parameters, straight.parameters)


def test_the_state_before_the_first_step_can_be_saved() -> None:
    state = FlatAdam(vector(0), learning_rate=0.01).state()
    assert state.steps == 0
    resumed = FlatAdam(vector(0), learning_rate=0.01)
    resumed.load_state(state)
    fresh = FlatAdam(vector(0), learning_rate=0.01)
    for optimizer in (resumed, fresh):
        optimizer.step(vector(1))
    np.testing.assert_array_equal(resumed.parameters, fresh.parameters)


def test_moments_of_another_size_are_refused() -> None:
    state = FlatAdam(vector(0, 5), learning_rate=0.01).state()
    with pytest.raises(ValueError, match="do not fit"):
        FlatAdam(vector(0), learning_rate=0.01).load_state(state)
