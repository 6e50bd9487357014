"""Object: A3C with the object layer of HOZ alone [Zhang et al. 2021, Eq. 6].

It also sees the detections, related by a learnt graph of categories (`hoz_dist.policy.layers.ObjectLayer`). What `hoz`
adds to it is the hierarchy.
"""

from typing import Final

from hoz_dist.policy.methods.description import Description

OBJECT: Final = Description(
    name="object",
    summary="object layer",
    layers=("object",),
    paper="Zhang et al., ICCV 2021, Eq. 6",
)
