"""The layer of method `org`: the object relation graph [Du et al. 2020, 3.2]."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.layers import DETECTION_FEATURES, ObjectLayer
from hoz_dist.policy.settings import PolicySettings


class RelationLayer(nn.Module):
    """Z = relu(A X W) relates the categories, F_hat = Z F attends to their appearance, and a map is made of each.

    X = [box 4, confidence, target indicator], as in the object layer of HOZ [Eq. 6], which is made after this. What
    differs: W has N columns, so Z is N x N, how much each category attends to each other's appearance, where Eq. 6
    has D_o free columns; F_hat thus has a row for each category, which is joined by the category's own box, confidence
    and target indicator again, and two linear layers make a map of each row, the same for all categories.

    Deviations: the released code relates the categories four times, with a ReLU and a bias each; here it is done once,
    as in Eq. 6 of HOZ. Half of the units of the first linear layer start as gates that pass the target's row and shut
    off others, as half of W_o's columns do in our object layer, so that neither has a better start.

    Args:
        settings: What shapes the network.
    """

    def __init__(self, settings: PolicySettings) -> None:
        super().__init__()
        categories, sizes, channels = len(TARGETS), settings.sizes, settings.channels
        self.adjacency = nn.Parameter(torch.eye(categories) + 0.01 * torch.randn(categories, categories))
        self.weight = nn.Parameter(torch.randn(DETECTION_FEATURES, categories) * 0.5)
        self.hidden = nn.Linear(channels + DETECTION_FEATURES, sizes.relation_hidden)
        self.map = nn.Linear(sizes.relation_hidden, sizes.relation)
        gated = sizes.relation_hidden // 2
        with torch.no_grad():
            box = slice(channels, channels + 4)
            self.hidden.weight[:gated, box] = torch.randn(gated, 4) * 1.5
            self.hidden.weight[:gated, -1] = ObjectLayer.GATE
            self.hidden.bias[:gated] = torch.rand(gated) - ObjectLayer.GATE

    @staticmethod
    def shape(settings: PolicySettings) -> tuple[int, ...]:
        """Return the shape of the output for one picture: N maps."""
        return settings.sizes.relation, len(TARGETS)

    def forward(self, detections: Tensor, appearance: Tensor, target: Tensor) -> Tensor:
        """Relate the detected objects.

        Args:
            detections: Boxes and confidences, [B, N, 5].
            appearance: F, [B, N, C].
            target: One-hot target indicator, [B, N].

        Returns:
            A map for each category, [B, M, N].
        """
        nodes = torch.cat([detections, target.unsqueeze(-1)], dim=-1)
        # A X first: it has 6 columns, W's product has N; and as X' A', one product for the whole batch.
        mixed = (nodes.transpose(1, 2) @ self.adjacency.t()).transpose(1, 2)
        attended = functional.relu(mixed @ self.weight) @ appearance  # [B, N, C]
        rows = functional.relu(self.hidden(torch.cat([attended, nodes], dim=-1)))
        return functional.relu(self.map(rows)).transpose(1, 2)
