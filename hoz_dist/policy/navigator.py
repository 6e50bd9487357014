"""Which scene, zone and sub-goal an agent uses at a step, and its local copy of the scene graph."""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from hoz_dist.graph.matching import ALPHA
from hoz_dist.nav.categories import SCENES, TARGETS
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.layers import ZoneLayer


class ZoneState(NamedTuple):
    """Local copies of the scene graph in B episodes; they last one episode."""

    nodes: Tensor
    """delta_t, [B, K, N]."""
    scene: Tensor
    """Scene whose graph was copied, [B]; -1 before the first step."""
    evidence: Tensor
    """Sum of the scene layer's log-probabilities since the episode began, [B, S]."""


class Guidance(NamedTuple):
    """Discrete decisions of a step, [B], or of a rollout, [T, B]."""

    scene: Tensor
    """Scene whose graph is used."""
    fresh: Tensor
    """Whether the local copy was made anew at this step (bool)."""
    current: Tensor
    """Current zone."""
    subgoal: Tensor
    """Sub-goal zone."""

    @classmethod
    def nothing(cls, batch: int) -> "Guidance":
        """Return the decisions of a policy without the zone layer."""
        zeros = torch.zeros(batch, dtype=torch.int64)
        return cls(zeros, torch.zeros(batch, dtype=torch.bool), zeros, zeros)


def initial_zone_state(batch: int, zones: int) -> ZoneState:
    """Return the state before any episode's first step."""
    return ZoneState(
        nodes=torch.zeros(batch, zones, len(TARGETS)),
        scene=torch.full((batch,), -1),
        evidence=torch.zeros(batch, len(SCENES)),
    )


def distance(nodes: Tensor, bag: Tensor) -> Tensor:
    """Return d(f, delta_k) = ||f - delta_k||_2 + 1 / (f . delta_k + alpha) of every zone [Eq. 3].

    Args:
        nodes: delta, [B, K, N].
        bag: f, [B, N].

    Returns:
        [B, K].
    """
    apart = (nodes - bag.unsqueeze(1)).square().sum(-1).sqrt()
    alike = (nodes @ bag.unsqueeze(-1)).squeeze(-1)
    return apart + 1.0 / (alike + ALPHA)


def guide(
    layer: ZoneLayer,
    bank: GraphBank,
    state: ZoneState,
    bag: Tensor,
    target: Tensor,
    scene_logits: Tensor | None,
    true_scene: Tensor,
    first: Tensor,
) -> tuple[ZoneState, Guidance]:
    """Look, find the current zone, update the local graph, and plan.

    The scene is the one that the scene layer's log-probabilities, summed over the episode's views, favour among the
    scenes whose graph is known: one view of a bare wall tells little. When it changes, the graph is copied anew.

    Args:
        layer: Holds lambda.
        bank: Scene graphs.
        state: State after the step before.
        bag: f_t, [B, N].
        target: One-hot target indicator, [B, N].
        scene_logits: Logits of the scene layer, [B, S]; None when it is switched off.
        true_scene: Scene of the room, [B]; used only without the scene layer, as in the released code.
        first: Whether the episode begins, [B].

    Returns:
        The state after the step and the decisions taken.
    """
    if scene_logits is None:
        evidence = functional.one_hot(true_scene, len(SCENES)).float()
    else:
        remembered = torch.where(first.unsqueeze(1), torch.zeros(()), state.evidence)
        # The scene layer of a run in rooms has no output for apartments.
        told = functional.log_softmax(scene_logits, dim=-1)
        evidence = remembered + functional.pad(told, (0, len(SCENES) - told.shape[1]), value=-torch.inf)
    scene = evidence.masked_fill(~bank.available, -torch.inf).argmax(dim=1)
    fresh = first | (scene != state.scene)
    nodes = torch.where(fresh[:, None, None], bank.nodes[scene], state.nodes)
    current = distance(nodes, bag).argmin(dim=1)
    nodes = layer.update(nodes, bag, functional.one_hot(current, nodes.shape[1]).float())
    goal = (nodes @ target.unsqueeze(-1)).squeeze(-1).argmax(dim=1)
    subgoal = bank.subgoals[scene, current, goal]
    return ZoneState(nodes, scene, evidence), Guidance(scene, fresh, current, subgoal)
