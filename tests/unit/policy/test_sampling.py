import numpy as np
import torch

from hoz_dist.policy.sampling import sample_actions

DRAWS = 20_000


def shares(temperature: float, logits: list[float]) -> torch.Tensor:
    """How often each action is drawn."""
    actions = sample_actions(torch.tensor(logits).expand(DRAWS, -1), np.random.default_rng(0), temperature)
    return torch.bincount(actions, minlength=len(logits)) / DRAWS


def test_actions_are_drawn_from_the_softmax_at_the_temperature() -> None:
    logits = [0.0, 1.0, -1.0]
    for temperature in (0.5, 1.0, 2.0):
        expected = (torch.tensor(logits) / temperature).softmax(dim=0)
        torch.testing.assert_close(shares(temperature, logits), expected, atol=0.015, rtol=0.0)


def test_without_a_temperature_actions_are_drawn_at_one() -> None:
    logits = torch.randn(100, 6, generator=torch.Generator().manual_seed(0))
    drawn = sample_actions(logits, np.random.default_rng(4))
    assert torch.equal(drawn, sample_actions(logits, np.random.default_rng(4), 1.0))
    assert not torch.equal(drawn, sample_actions(logits, np.random.default_rng(4), 0.5))


def test_towards_zero_the_likeliest_action_alone_is_drawn() -> None:
    assert shares(0.01, [0.0, 0.5, 0.3]).tolist() == [0.0, 1.0, 0.0]
