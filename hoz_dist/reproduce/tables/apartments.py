"""Table 8 of the paper: apartments of several rooms, RoboTHOR's there and generated ones here.

The paper's figures were not at hand. There is one graph over all apartments, as in the paper; it has 16 zones, since an
apartment has about as many kinds of places as two rooms; and a longer horizon than rooms, since ways are nearly three
times as long (docs/decisions/recipe.md). The scene layer is off: there is one scene, so it has nothing to tell, and it
costs (docs/results.md). `object and zone` is ours: `object` with the zone layer and nothing else, so that their
difference is what the graph gives. So are the agents with zones that are guided at random at the test alone: what they
lose is what their policies make of their guidance.
"""

from typing import Final

from hoz_dist.reproduce.row import Row, Table

_LONG: Final = {"discount": 0.99}
_ZONES: Final = {**_LONG, "zones": 16, "without": ("scene",)}
_ZONES_ALONE: Final = {**_ZONES, "without": ("scene", "done")}
_AT_RANDOM: Final = {"subgoal": "random"}

APARTMENTS: Final = Table(
    name="apartments",
    title="Methods in apartments (Table 8)",
    references=("object", "a3c", "org", "hoz", "object and zone"),
    scenes=("apartment",),
    rows=(
        Row(name="random", agent="random"),
        Row(name="a3c", agent="a3c", more_seeds=True, options=_LONG),
        Row(name="object", agent="object", more_seeds=True, options=_LONG),
        Row(name="object and zone", agent="hoz", more_seeds=True, options=_ZONES_ALONE),
        Row(
            name="object and zone, tested with random zones",
            agent="hoz",
            more_seeds=True,
            options=_ZONES_ALONE,
            tested_with=_AT_RANDOM,
        ),
        Row(name="org", agent="org", options=_LONG),
        Row(name="hoz", agent="hoz", more_seeds=True, options=_ZONES),
        Row(name="hoz, tested with random zones", agent="hoz", more_seeds=True, options=_ZONES, tested_with=_AT_RANDOM),
        Row(name="hoz-tpn", agent="hoz-tpn", options=_ZONES),
        Row(name="oracle", agent="oracle"),
    ),
    note="Rows have the same episodes, frames, learning rate and schedules. Boxes are the ground truth's; `a3c` sees "
    "none. `hoz`, `hoz-tpn` and `object and zone` have 16 zones and no scene layer, the last no done reminder either; "
    "`hoz-tpn` is taught in deadlocks, too. Rows called `tested with random zones` are the very agents of the row "
    "before, guided to random zones at the test alone.",
)
