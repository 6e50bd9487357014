"""SAVN: self-adaptive visual navigation [Wortsman et al. 2019].

It sees what `a3c` sees. A loss that needs no labels, and is learnt itself, adapts the actor's head four times within an
episode, in evaluation as in training (`hoz_dist.policy.steering_savn`).
"""

from typing import Final

from hoz_dist.policy.methods.description import Description

SAVN: Final = Description(
    name="savn",
    summary="a learnt loss adapts it in each episode",
    layers=("savn",),
    paper="Wortsman et al., CVPR 2019",
)
