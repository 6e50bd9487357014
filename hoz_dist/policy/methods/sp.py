"""SP: scene priors [Yang et al. 2019, 3.2].

Besides what `a3c` sees, a fixed graph says which categories are found near each other. A graph convolution network
spreads over it what the detector says of the picture (confidences), and its output joins the policy's inputs
(`hoz_dist.policy.layers_sp.PriorLayer`). The graph is counted in our training rooms (`hoz_dist.sim.closeness`), or
comes from Visual Genome, as in the paper, with ``--relations`` (`hoz_dist.policy.relations`).
"""

from typing import Final

from hoz_dist.policy.methods.description import Description

SP: Final = Description(
    name="sp",
    summary="scene priors: a fixed graph of related categories",
    layers=("sp",),
    paper="Yang et al., ICLR 2019, 3.2",
)
