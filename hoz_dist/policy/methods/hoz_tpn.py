"""HOZ-TPN: `hoz` with the tentative policy network of ORG [Zhang et al. 2021; Du et al. 2020].

What TPN adds is the same as in `org-tpn` (`hoz_dist.policy.steering_tpn`).
"""

from typing import Final

from hoz_dist.policy.methods.description import Description
from hoz_dist.policy.methods.hoz import HOZ

HOZ_TPN: Final = Description(
    name="hoz-tpn",
    summary="hoz, with memory and tentative policy for deadlocks",
    layers=(*HOZ.layers, "tpn"),
    paper="Zhang et al., ICCV 2021; Du et al., ECCV 2020",
)
