"""Tables 3 and 9 of the paper: HOZ among the methods that it was compared with, in rooms.

The paper's figures are those on AI2-THOR with 22 targets. `object` is ours: it sees the boxes that `hoz` sees and has
no zones. `hoz` also has a scene layer and a done reminder; the rows of `components` tell these apart.
"""

from typing import Final

from hoz_dist.reproduce.row import Figures, Paper, Row, Table
from hoz_dist.reproduce.tables.common import A3C, HOZ, OBJECT, ORACLE, RANDOM

METHODS: Final = Table(
    name="methods",
    title="Methods in rooms (Tables 3 and 9)",
    references=("object", "a3c", "org", "hoz"),
    rows=(
        RANDOM,
        A3C,
        OBJECT,
        Row(name="sp", agent="sp", paper=Paper(Figures(62.16, 37.01, 23.39), Figures(50.86, 34.17, 24.35))),
        Row(name="savn", agent="savn", paper=Paper(Figures(63.32, 37.62, 21.97), Figures(52.38, 35.31, 24.64))),
        Row(name="org", agent="org", paper=Paper(Figures(66.38, 38.42, 25.36), Figures(55.55, 36.26, 27.53))),
        Row(name="org-tpn", agent="org-tpn", paper=Paper(Figures(67.31, 39.53, 23.07), Figures(57.41, 38.27, 26.37))),
        HOZ,
        Row(name="hoz-tpn", agent="hoz-tpn", paper=Paper(Figures(73.15, 39.22, 29.49), Figures(64.58, 39.80, 30.92))),
        ORACLE,
    ),
    note="Rows have the same episodes, frames, learning rate and schedules. Boxes are the ground truth's; `a3c` and "
    "`savn` see none, `sp` sees confidences alone. Those with TPN are taught in deadlocks, too.",
)
