"""Table 2 of the paper: what each part of HOZ contributes.

The paper's text could not be read when this was written, so its rows are not certain. These take the parts away one by
one, between `a3c`, which has none, and `hoz`, which has all.
"""

from typing import Final

from hoz_dist.reproduce.row import Row, Table
from hoz_dist.reproduce.tables.common import A3C, HOZ, OBJECT, WITHOUT_ZONE

COMPONENTS: Final = Table(
    name="components",
    title="Components of HOZ (Table 2)",
    references=("object", "hoz", "hoz without object and zone", "a3c"),
    rows=(
        A3C,
        OBJECT,
        Row(name="object and zone", agent="hoz", more_seeds=True, options={"without": ("scene", "done")}),
        Row(name="object, scene and zone", agent="hoz", options={"without": ("done",)}),
        WITHOUT_ZONE,
        Row(name="hoz without scene", agent="hoz", options={"without": ("scene",)}),
        Row(name="hoz without object", agent="hoz", options={"without": ("object",)}),
        Row(name="hoz without object and zone", agent="hoz", options={"without": ("object", "zone")}),
        HOZ,
    ),
    note="The rows are ours: the paper's were not at hand. Without the scene layer, hoz is told the true scene. The "
    "two without the object layer say what zones give to a policy that sees no boxes itself.",
)
