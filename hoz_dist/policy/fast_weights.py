"""Fast weights of the actor's head: an increment dW of its weights for each episode adds dW h to the logits.

Without a done reminder the logits are then (W + dW) h + b. Where there is one, which is in `hoz-tpn` alone, dW h is
added after it: Done's logit is beta p' f^s (w h + b) + dw h, and so not exactly 0 while the target is not seen.

Methods that adapt within an episode (`savn`, and those with TPN) adapt the head alone, where their papers adapt all of
the network. Each of B episodes needs adapted weights of its own: copies of all weights would cost B times the memory,
and every layer would run B times over instead of once for the batch. Raghu et al., *Rapid Learning or Feature Reuse?*
(ICLR 2020), find that what such inner steps change is nearly the head alone, and lose nothing by adapting only that.

A gradient by dW is a sum of products ``e h'`` of an error of the logits, [6], and the outputs at the step, [H]. So
both an update and what it changes at a step t, ``(h . h_t) e``, need no differentiation through the head.
"""

import torch
from torch import Tensor


def steps_before(made: Tensor, first: Tensor) -> Tensor:
    """Return how many steps an episode has made before each step.

    Args:
        made: Before the first step given, int64 [B]; of no meaning where that begins an episode.
        first: Whether the step begins an episode, bool [T, B].

    Returns:
        int64 [T, B].
    """
    order = torch.arange(len(first)).unsqueeze(1)
    begun = torch.where(first, order, -1).cummax(dim=0).values
    return torch.where(begun < 0, made + order, order - begun)


def change_of_logits(outputs: Tensor, increments: Tensor) -> Tensor:
    """Return dW h.

    Args:
        outputs: h, [T, B, H].
        increments: dW, [B, 6, H].

    Returns:
        [T, B, 6].
    """
    return (outputs.transpose(0, 1) @ increments.mT).transpose(0, 1)
