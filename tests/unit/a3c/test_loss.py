import math
from dataclasses import replace

import pytest
import torch
from torch.nn import functional

from hoz_dist.a3c.loss import LossWeights, a3c_loss, mean_terms
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.policy.steering import Imitation
from tests.unit.a3c.making import make_rollout

WEIGHTS = LossWeights(discount=0.9, gae_lambda=0.95, value=0.0, entropy=0.0, scene=0.0)


def test_a_step_along_the_gradient_favours_actions_that_went_well() -> None:
    rollout = make_rollout(steps=1, batch=2, seed=0, ends=False)
    rollout = replace(
        rollout,
        actions=torch.tensor([[2, 4]]),
        rewards=torch.tensor([[1.0, -1.0]]),
        values=torch.zeros(1, 2),
        bootstrap=torch.zeros(2),
    )
    logits = torch.zeros(1, 2, 6, requires_grad=True)
    a3c_loss(rollout, logits, torch.zeros(1, 2), WEIGHTS).total.backward()  # type: ignore[no-untyped-call]
    assert logits.grad is not None
    assert logits.grad[0, 0, 2] < 0 < logits.grad[0, 1, 4]


def test_the_value_moves_to_the_return() -> None:
    rollout = make_rollout(steps=4, batch=3, seed=1)
    values = rollout.values.clone().requires_grad_()
    a3c_loss(rollout, torch.zeros(4, 3, 6), values, WEIGHTS._replace(value=1.0)).total.backward()  # type: ignore[no-untyped-call]
    assert values.grad is not None
    after = a3c_loss(rollout, torch.zeros(4, 3, 6), values.detach() - 0.5 * values.grad, WEIGHTS)
    assert after.value < a3c_loss(rollout, torch.zeros(4, 3, 6), rollout.values, WEIGHTS).value


def test_steps_that_only_reset_do_not_count() -> None:
    rollout = make_rollout(steps=6, batch=5, seed=2)
    assert not rollout.valid.all()
    logits = torch.randn(6, 5, 6, requires_grad=True)
    values = torch.randn(6, 5, requires_grad=True)
    a3c_loss(rollout, logits, values, WEIGHTS._replace(value=1.0, entropy=1.0)).total.backward()  # type: ignore[no-untyped-call]
    assert logits.grad is not None
    assert values.grad is not None
    assert logits.grad[~rollout.valid].abs().max() == 0.0
    assert values.grad[~rollout.valid].abs().max() == 0.0


def test_entropy_of_the_uniform_policy_is_log_six() -> None:
    rollout = make_rollout(steps=3, batch=2, seed=3)
    loss = a3c_loss(rollout, torch.zeros(3, 2, 6), torch.zeros(3, 2), WEIGHTS)
    assert math.isclose(loss.entropy, math.log(6), rel_tol=1e-5)


def test_scene_labels_train_the_scene_layer() -> None:
    rollout = make_rollout(steps=2, batch=2, seed=4)
    scene_logits = torch.zeros(2, 2, 4, requires_grad=True)
    labels = torch.full((2, 2), 3)
    arguments = (rollout, torch.zeros(2, 2, 6), torch.zeros(2, 2), WEIGHTS._replace(scene=1.0), scene_logits, labels)
    a3c_loss(*arguments).total.backward()  # type: ignore[no-untyped-call]
    assert scene_logits.grad is not None
    assert (scene_logits.grad[..., 3] < 0).all()


def test_imitation_moves_what_counts_to_the_experts_action_and_nothing_else() -> None:
    """Not where the step only reset, where no path leads to the target, or where the steering does not ask for it."""
    rollout = make_rollout(steps=2, batch=4, seed=5, ends=False)
    rollout.valid[0, 1] = False
    labels = torch.tensor([[3, 3, 0, 3], [5, 0, 1, 2]])
    expert = functional.one_hot(labels, 6).bool()
    expert[0, 2] = False
    counts = torch.tensor([[True, True, True, False], [True, True, True, True]])
    imitated = torch.zeros(2, 4, 2, 6, requires_grad=True)  # two policies
    arguments = (replace(rollout, expert=expert), torch.zeros(2, 4, 6), torch.zeros(2, 4))
    loss = a3c_loss(*arguments, WEIGHTS._replace(imitation=2.0), imitation=Imitation(imitated, counts))
    loss.total.backward()  # type: ignore[no-untyped-call]
    assert loss.imitation == pytest.approx(2 * 5 * math.log(6) / 7, rel=1e-5)
    assert imitated.grad is not None
    assert imitated.grad[0, 1:].abs().max() == 0.0
    for t, b in ((0, 0), (1, 0), (1, 1), (1, 2), (1, 3)):
        assert (imitated.grad[t, b].argmin(dim=-1) == labels[t, b]).all()
    torch.testing.assert_close(imitated.grad[0, 0, :, 3], torch.full((2,), 2.0 * (1 / 6 - 1) / 7))


def test_without_the_experts_actions_nothing_is_imitated() -> None:
    rollout = make_rollout(steps=2, batch=4, seed=5)
    imitation = Imitation(torch.zeros(2, 4, 1, 6, requires_grad=True), torch.ones(2, 4, dtype=torch.bool))
    arguments = (rollout, torch.zeros(2, 4, 6), torch.zeros(2, 4), WEIGHTS._replace(imitation=1.0))
    assert a3c_loss(*arguments, imitation=imitation).imitation is None


def approaching() -> tuple[Rollout, torch.Tensor]:
    """A rollout [2, 4] with what begins shortest paths, and where the target was seen.

    Taught are steps (0, 0), where two actions begin a path, and (1, 0). Of the other episodes one was not begun yet
    and then has not seen the target, one has no path, and one never sees the target.
    """
    rollout = make_rollout(steps=2, batch=4, seed=5, ends=False)
    rollout.valid[0, 1] = False
    expert = torch.zeros(2, 4, 6, dtype=torch.bool)
    expert[..., 2] = True
    expert[0, 0, 4] = True
    expert[:, 2] = False
    target_seen = torch.tensor([[True, True, True, False], [True, False, True, False]])
    return replace(rollout, expert=expert), target_seen


def gradient_of(
    rollout: Rollout, target_seen: torch.Tensor | None, weight: float, logits: torch.Tensor
) -> torch.Tensor:
    """Gradient of the loss by the policy's logits, [T, B, 6]."""
    logits = logits.clone().requires_grad_()
    weights = WEIGHTS._replace(approach=weight)
    a3c_loss(rollout, logits, torch.zeros(2, 4), weights, target_seen=target_seen).total.backward()  # type: ignore[no-untyped-call]
    assert logits.grad is not None
    return logits.grad


def test_the_approach_is_taught_once_the_target_was_seen_and_nowhere_else() -> None:
    """Where the step was taken and a path exists."""
    rollout, target_seen = approaching()
    logits = torch.randn(2, 4, 6, generator=torch.Generator().manual_seed(0))
    taught = gradient_of(rollout, target_seen, 0.5, logits) - gradient_of(rollout, None, 0.5, logits)
    assert (taught.abs().amax(dim=-1) > 1e-6).nonzero().tolist() == [[0, 0], [1, 0]]
    assert (taught[0, 0] < 0).nonzero().flatten().tolist() == [2, 4], "any of the shortest ways will do"
    assert (taught[1, 0] < 0).nonzero().flatten().tolist() == [2]


def test_the_approach_is_the_surprise_at_doing_any_of_what_the_expert_might() -> None:
    rollout, target_seen = approaching()
    arguments = (rollout, torch.zeros(2, 4, 6), torch.zeros(2, 4))
    loss = a3c_loss(*arguments, WEIGHTS._replace(approach=0.5), target_seen=target_seen)
    without = a3c_loss(*arguments, WEIGHTS)
    approach = (math.log(6 / 2) + math.log(6)) / 7
    assert loss.approach == pytest.approx(approach, rel=1e-5)
    assert loss.total.item() == pytest.approx(without.total.item() + 0.5 * approach, rel=1e-5)


def test_what_is_taught_is_reported_and_what_is_not_is_left_out() -> None:
    """A term that was 0 where its weight is would look as if it had been learnt."""
    rollout, target_seen = approaching()
    arguments = (rollout, torch.zeros(2, 4, 6), torch.zeros(2, 4))
    untaught = a3c_loss(*arguments, WEIGHTS, target_seen=target_seen).terms()
    assert set(untaught) == {"policy_loss", "value_loss", "entropy", "scene_loss"}
    taught = a3c_loss(*arguments, WEIGHTS._replace(approach=0.5), target_seen=target_seen)
    assert taught.terms() == untaught | {"approach_loss": taught.approach}
    imitation = Imitation(torch.zeros(2, 4, 1, 6), torch.ones(2, 4, dtype=torch.bool))
    imitating = a3c_loss(*arguments, WEIGHTS, imitation=imitation)
    assert imitating.terms() == untaught | {"imitation_loss": imitating.imitation}


def test_means_of_terms_are_over_the_losses_that_have_them() -> None:
    losses = [{"entropy": 1.0, "approach_loss": 0.5}, {"entropy": 2.0}, {"entropy": 6.0, "approach_loss": 0.25}]
    assert mean_terms(losses) == {"entropy": 3.0, "approach_loss": 0.375}
    assert mean_terms([]) == {}


def test_without_weight_labels_or_sight_the_loss_is_what_it_was() -> None:
    rollout, target_seen = approaching()
    unlabelled = replace(rollout, expert=None)
    logits = torch.randn(2, 4, 6, generator=torch.Generator().manual_seed(1))
    plain = gradient_of(unlabelled, None, 0.0, logits)
    assert torch.equal(gradient_of(rollout, target_seen, 0.0, logits), plain)
    assert torch.equal(gradient_of(unlabelled, target_seen, 0.5, logits), plain)
    assert torch.equal(gradient_of(rollout, torch.zeros_like(target_seen), 0.5, logits), plain)


def test_what_a_policy_never_does_is_taught_by_a_finite_gradient() -> None:
    rollout, target_seen = approaching()
    logits = torch.zeros(2, 4, 6)
    logits[..., 2] = logits[..., 4] = -1e4
    gradient = gradient_of(rollout, target_seen, 0.5, logits)
    assert gradient.isfinite().all()
    assert (gradient[0, 0, [2, 4]] < 0).all()
