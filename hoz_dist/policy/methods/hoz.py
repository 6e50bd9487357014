"""HOZ: hierarchical object-to-zone graphs [Zhang et al. 2021].

It also sees the detections (object layer, Eq. 6), its guess of the scene (scene layer), the sub-goal zone of a path in
the scene's graph, which it updates as it goes (zone layer, Eq. 4 and 5), and is reminded of Done (5.2).
"""

from typing import Final

from hoz_dist.policy.methods.description import Description

HOZ: Final = Description(
    name="hoz",
    summary="object, scene and zone layer, done reminder",
    layers=("object", "scene", "zone", "done"),
    paper="Zhang et al., ICCV 2021, 4 and 5.2",
)
