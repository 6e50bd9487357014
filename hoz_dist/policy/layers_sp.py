"""The layer of method `sp`: a graph convolution network over a fixed graph of categories [Yang et al. 2019, 3.2]."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.graph.planner import normalized_adjacency
from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.relations import relation_matrix
from hoz_dist.policy.settings import PolicySettings


class PriorLayer(nn.Module):
    """Three graph convolutions, H_{l+1} = relu(A_hat H_l W_l), and a linear map of their N outputs.

    As in the paper, every node holds an embedding of the whole picture's class scores, the same for all, beside one of
    its own category; the last convolution has one output per node. Deviations: the scores are the confidences that the
    detector has in our N categories, not those of an ImageNet classifier; the embedding of a category is learnt, as
    word vectors cannot be downloaded; the nodes are the N targets (the paper has 53 categories, the re-implementation
    by SAVN's authors 83); the last convolution has no ReLU, which with one output leaves only zeros for some seeds.

    Args:
        settings: What shapes the network; its relations are the graph.
    """

    def __init__(self, settings: PolicySettings) -> None:
        super().__init__()
        width, categories = settings.sizes.prior_nodes, len(TARGETS)
        # Not a parameter: it follows from the settings. A_hat = D^-1/2 A D^-1/2, the diagonal of A is 1.
        adjacency = normalized_adjacency(relation_matrix(settings.relations))
        self.register_buffer("adjacency", torch.from_numpy(adjacency).float(), persistent=False)
        self.scores = nn.Linear(categories, width)
        self.categories = nn.Parameter(torch.randn(categories, width) / width**0.5)
        self.first_scores = nn.Linear(width, width, bias=False)
        self.first_categories = nn.Linear(width, width, bias=False)
        self.second = nn.Linear(width, width, bias=False)
        self.third = nn.Linear(width, 1, bias=False)
        self.map = nn.Linear(categories, settings.sizes.prior)

    @staticmethod
    def shape(settings: PolicySettings) -> tuple[int, ...]:
        """Return the shape of the output for one picture: a vector."""
        return (settings.sizes.prior,)

    def forward(self, detections: Tensor, appearance: Tensor, target: Tensor) -> Tensor:
        """Spread what is seen over the graph.

        Args:
            detections: Boxes and confidences, [B, N, 5]; only the confidences are used.
            appearance: Not used.
            target: Not used; the target reaches the policy beside this.

        Returns:
            [B, X].
        """
        del appearance, target
        adjacency: Tensor = self.get_buffer("adjacency")
        # A_hat [s 1', E] W_0 in two parts: the scores are the same in all nodes, so A_hat only adds up its rows for
        # them, and the categories' part does not depend on the picture.
        scores = self.first_scores(functional.relu(self.scores(detections[..., 4])))
        own = adjacency @ self.first_categories(self.categories)
        nodes = functional.relu(adjacency.sum(dim=1)[:, None] * scores[:, None] + own)  # [B, N, width]
        nodes = functional.relu(adjacency @ self.second(nodes))
        return self.map((adjacency @ self.third(nodes)).squeeze(-1))  # type: ignore[no-any-return]
