"""A3C: the network that all methods share, and nothing else.

It sees the picture, the target indicator and its previous action. [Zhang et al. 2021, 5.2, the baseline.]
"""

from typing import Final

from hoz_dist.policy.methods.description import Description

A3C: Final = Description(
    name="a3c",
    summary="nothing besides picture, target and previous action",
    layers=(),
    paper="Mnih et al., ICML 2016, Algorithm S3",
)
