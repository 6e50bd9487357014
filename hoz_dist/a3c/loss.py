"""The loss of A3C (Mnih et al. 2016, Algorithm S3), of the scene layer, and of imitation."""

from collections.abc import Collection, Mapping
from statistics import fmean
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from hoz_dist.a3c.returns import generalized_advantages
from hoz_dist.a3c.rollout import Rollout
from hoz_dist.a3c.vtrace import vtrace
from hoz_dist.policy.steering import Imitation

ADVANTAGE_FLOOR = 0.05
"""Least scale by which advantages are divided, so that noise is not blown up when nothing differs."""


class LossWeights(NamedTuple):
    """Factors of the loss's terms."""

    discount: float
    gae_lambda: float
    value: float
    entropy: float
    scene: float
    imitation: float = 0.0
    approach: float = 0.0


class Loss(NamedTuple):
    """The loss and its terms, scalars; only `total` carries a gradient."""

    total: Tensor
    policy: float
    value: float
    entropy: float
    scene: float
    imitation: float | None = None
    """None where nothing is imitated."""
    approach: float | None = None
    """None where the approach is not taught, as once its weight is 0; 0 in a rollout in which no target was seen."""

    def terms(self) -> dict[str, float]:
        """Return the terms that there are, by the names that are reported."""
        terms = {
            "policy_loss": self.policy,
            "value_loss": self.value,
            "entropy": self.entropy,
            "scene_loss": self.scene,
            "imitation_loss": self.imitation,
            "approach_loss": self.approach,
        }
        return {name: value for name, value in terms.items() if value is not None}


def mean_terms(losses: Collection[Mapping[str, float]]) -> dict[str, float]:
    """Return the mean of each term over those losses that have it.

    Args:
        losses: What `Loss.terms` returned.
    """
    names = dict.fromkeys(name for terms in losses for name in terms)
    return {name: fmean(terms[name] for terms in losses if name in terms) for name in names}


def a3c_loss(
    rollout: Rollout,
    logits: Tensor,
    values: Tensor,
    weights: LossWeights,
    scene_logits: Tensor | None = None,
    scenes: Tensor | None = None,
    imitation: Imitation | None = None,
    target_seen: Tensor | None = None,
) -> Loss:
    """Compute the loss of a rollout, averaged over the actions taken.

    Advantages are divided by their standard deviation in the rollout: success comes rarely at first and often later,
    and the entropy bonus keeps its meaning against either.

    A rollout that another policy acted is corrected by V-trace. Its ratios come after the division, which would
    otherwise give back what they take from a rollout that this policy would hardly have acted.

    Args:
        rollout: T steps of B episodes.
        logits: Of the policy at each step, [T, B, actions].
        values: Of the critic at each step, [T, B].
        weights: Factors of the terms.
        scene_logits: Of the scene layer, [T, B, S], if it is on.
        scenes: True scenes, int64 [T, B], the labels of `scene_logits`.
        imitation: What is to be taught the expert's actions besides, if anything is; the rollout then knows them.
        target_seen: Whether the target has been seen in the episode, bool [T, B]: there the policy is taught the
            expert's actions, if the rollout knows them.
    """
    valid = rollout.valid.float()
    count = max(rollout.frames if rollout.taken is None else rollout.taken, 1)
    log_probabilities = functional.log_softmax(logits, dim=-1)
    chosen = log_probabilities.gather(-1, rollout.actions.unsqueeze(-1)).squeeze(-1)
    if rollout.log_probabilities is None:
        advantages, returns = generalized_advantages(rollout, weights.discount, weights.gae_lambda)
        counting = valid
    else:
        ratios, advantages, returns = vtrace(rollout, chosen.detach(), weights.discount, weights.gae_lambda)
        counting = ratios * valid
    learnt = advantages[rollout.valid] if rollout.valid.any() else advantages.new_zeros(1)
    scale = learnt.std(correction=0).clamp(min=ADVANTAGE_FLOOR)

    policy = -(chosen * (advantages / scale) * counting).sum() / count
    value = 0.5 * ((values - returns).square() * valid).sum() / count
    entropy = -((log_probabilities.exp() * log_probabilities).sum(-1) * valid).sum() / count
    total = policy + weights.value * value - weights.entropy * entropy
    scene = torch.zeros(())
    if scene_logits is not None and scenes is not None:
        scene = functional.cross_entropy(scene_logits.flatten(0, 1), scenes.flatten())
        total = total + weights.scene * scene
    imitated = approached = None
    if imitation is not None and rollout.expert is not None:
        taught = functional.log_softmax(imitation.logits, dim=-1)  # [T, B, K, 6]
        counts = (imitation.counts & rollout.valid).unsqueeze(-1).expand(taught.shape[:-1])
        imitated = _surprise(taught, rollout.expert.unsqueeze(2).expand_as(taught), counts) / count
        total = total + weights.imitation * imitated
    if target_seen is not None and rollout.expert is not None and weights.approach > 0.0:
        approached = _surprise(log_probabilities, rollout.expert, target_seen & rollout.valid) / count
        total = total + weights.approach * approached
    always = (term.item() for term in (policy, value, entropy, scene))
    where_taught = (None if term is None else term.item() for term in (imitated, approached))
    return Loss(total, *always, *where_taught)


def _surprise(log_probabilities: Tensor, expert: Tensor, counts: Tensor) -> Tensor:
    """Return the negative log-probability of doing any of what the expert might do, summed over steps, nats.

    Args:
        log_probabilities: Of the actions, [..., 6].
        expert: Which of them the expert might take, bool [..., 6].
        counts: At which steps, bool [...].
    """
    counts = counts & expert.any(dim=-1)
    return -log_probabilities[counts].masked_fill(~expert[counts], -torch.inf).logsumexp(dim=-1).sum()
