"""ORG-TPN: object relation graph and tentative policy network [Du et al. 2020].

`org`, which where it comes back to a view is taught the expert's action in training, and adapts to a tentative policy,
made of a memory of the episode, in evaluation too (`hoz_dist.policy.steering_tpn`).
"""

from typing import Final

from hoz_dist.policy.methods.description import Description
from hoz_dist.policy.methods.org import ORG

ORG_TPN: Final = Description(
    name="org-tpn",
    summary="org, with memory and tentative policy for deadlocks",
    layers=(*ORG.layers, "tpn"),
    paper="Du et al., ECCV 2020",
)
