"""Rows that several tables share: they are trained and tested once."""

from typing import Final

from hoz_dist.reproduce.row import Figures, Paper, Row

RANDOM: Final = Row(name="random", agent="random", paper=Paper(Figures(3.56, 1.73, 0.41), Figures(0.27, 0.07, 0.06)))
ORACLE: Final = Row(name="oracle", agent="oracle")
A3C: Final = Row(
    name="a3c", agent="a3c", more_seeds=True, paper=Paper(Figures(57.35, 33.78, 19.02), Figures(45.77, 30.65, 20.04))
)
OBJECT: Final = Row(name="object", agent="object", more_seeds=True)
HOZ: Final = Row(
    name="hoz", agent="hoz", more_seeds=True, paper=Paper(Figures(70.62, 40.02, 27.97), Figures(62.75, 39.24, 30.14))
)
WITHOUT_ZONE: Final = Row(name="hoz without zone", agent="hoz", options={"without": ("zone",)})
"""The zone layer alone is off: no graph guides the agent."""
