"""The layers that guide the agent: object layer [Eq. 6], zone layer [Eq. 5], scene layer, done reminder [5.2]."""

from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional

DETECTION_FEATURES: Final = 6
"""Columns of X_o: box (4), confidence, target indicator."""


class ObjectLayer(nn.Module):
    """Object embedding H_o = relu(A X_o W_o); the policy gets H_o' f^v [Eq. 6].

    Deviation from the paper: f^v is extended by the confidence, so that the embedding of a seen object also reaches the
    policy when its appearance is near zero (the pooled encoder's features are centred).

    Args:
        categories: N.
        features: D_o, columns of W_o.
    """

    GATE: Final = 3.0
    """How firmly the gating columns of W_o shut off other objects than the target at the start; boxes are in [0, 1]."""

    def __init__(self, categories: int, features: int) -> None:
        super().__init__()
        self.adjacency = nn.Parameter(torch.eye(categories) + 0.01 * torch.randn(categories, categories))
        weight = torch.randn(DETECTION_FEATURES, features) * 0.5
        # Half of the columns start as gates that pass the target's box and shut off other objects, which have the
        # confidence but not the target indicator. It is where training goes anyway; starting there saves frames.
        gated = features // 2
        weight[4, :gated] = torch.rand(gated) - self.GATE
        weight[5, :gated] = self.GATE
        weight[:4, :gated] *= 3.0
        self.weight = nn.Parameter(weight)

    def forward(self, detections: Tensor, appearance: Tensor, target: Tensor) -> Tensor:
        """Embed the detected objects.

        Args:
            detections: Boxes and confidences, [B, N, 5].
            appearance: f^v, [B, N, C].
            target: One-hot target indicator, [B, N].

        Returns:
            H_o' f^v, [B, D_o, C + 1].
        """
        nodes = torch.cat([detections, target.unsqueeze(-1)], dim=-1)
        # A X_o first: it has 6 columns, W_o's product has D_o; and as X_o' A', one product for the whole batch.
        mixed = (nodes.transpose(1, 2) @ self.adjacency.t()).transpose(1, 2)
        embedding = functional.relu(mixed @ self.weight)  # [B, N, D_o]
        values = torch.cat([appearance, detections[..., 4:5]], dim=-1)  # [B, N, C + 1]
        return embedding.transpose(1, 2) @ values


class ZoneLayer(nn.Module):
    """Zone embedding H_z = relu(E_hat delta_t W_z) with online update [Eq. 4, 5]; the policy gets H_z' Z_sub.

    Args:
        categories: N.
        features: D_z, columns of W_z.
    """

    def __init__(self, categories: int, features: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.randn(categories, features) / categories**0.5 * 2.0)
        # lambda = sigmoid(rate) stays in (0, 1); 0.1 at the start.
        self.rate = nn.Parameter(torch.logit(torch.tensor(0.1)))

    @property
    def update_rate(self) -> Tensor:
        """Lambda of Eq. 4, a scalar in (0, 1)."""
        # Without the bounds, float32 rounds the sigmoid of a large number to 1.
        return torch.sigmoid(self.rate).clamp(1e-4, 1.0 - 1e-4)

    def update(self, nodes: Tensor, bag: Tensor, current: Tensor) -> Tensor:
        """Move the current zone's node towards the view, delta_t of Eq. 4.

        Args:
            nodes: delta_{t-1}, [B, K, N].
            bag: f_t, [B, N].
            current: One-hot current zone, [B, K].

        Returns:
            delta_t, [B, K, N].
        """
        step = (self.update_rate * current).unsqueeze(-1)
        return nodes + step * (bag.unsqueeze(1) - nodes)

    def forward(self, nodes: Tensor, adjacency: Tensor) -> Tensor:
        """Embed the sub-goal zone.

        Only the sub-goal's row of H_z is needed, so only that row is computed.

        Args:
            nodes: delta_t, [B, K, N].
            adjacency: The sub-goal's row of the normalised adjacency E_hat, [B, K].

        Returns:
            H_z' Z_sub, [B, D_z].
        """
        mixed = (adjacency.unsqueeze(1) @ nodes).squeeze(1)  # [B, N]
        return functional.relu(mixed @ self.weight)


class SceneLayer(nn.Module):
    """Tells which scene the agent is in, from picture and detections.

    Args:
        picture: F, the number of picture features.
        categories: N.
        scenes: S.
    """

    def __init__(self, picture: int, categories: int, scenes: int) -> None:
        super().__init__()
        self.linear = nn.Linear(picture + categories, scenes)

    def forward(self, picture: Tensor, confidence: Tensor) -> Tensor:
        """Return the logits of the scenes.

        Args:
            picture: Picture features, [B, F].
            confidence: Confidence per category, [B, N].

        Returns:
            Logits, [B, S].
        """
        return self.linear(torch.cat([picture, confidence], dim=-1))  # type: ignore[no-any-return]


class DoneReminder(nn.Module):
    """Multiplies Done's logit by beta p' f^s, the other logits unchanged [5.2]."""

    def __init__(self) -> None:
        super().__init__()
        self.beta = nn.Parameter(torch.tensor(0.6))

    def forward(self, logits: Tensor, confidence: Tensor, target: Tensor) -> Tensor:
        """Remind the agent of Done by the target's confidence.

        Args:
            logits: Of the six actions, Done last, [B, 6].
            confidence: f^s, confidence per category, [B, N].
            target: p, one-hot target indicator, [B, N].

        Returns:
            Logits, [B, 6].
        """
        seen = self.beta * (confidence * target).sum(-1, keepdim=True)
        return torch.cat([logits[..., :-1], logits[..., -1:] * seen], dim=-1)
