"""ORG: object relation graph [Du et al. 2020, 3.2].

Besides what `a3c` sees, the detections: a learnt graph relates their boxes and confidences, and says how much each
category attends to the appearance of each other (`hoz_dist.policy.layers_org.RelationLayer`, which tells how that
differs from the object layer of HOZ).
"""

from typing import Final

from hoz_dist.policy.methods.description import Description

ORG: Final = Description(
    name="org",
    summary="object relation graph",
    layers=("org",),
    paper="Du et al., ECCV 2020, 3.2",
)
