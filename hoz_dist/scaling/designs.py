"""Designs to compare: what there is, with less on the wire, and what could come next."""

from dataclasses import replace
from typing import Final, NamedTuple

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.setting import Setting

SHARDS: Final = 16
FAN_OUT: Final = 8


class Design(NamedTuple):
    """One way to run so many actors."""

    name: str
    costs: Costs
    setting: Setting


def designs(costs: Costs, setting: Setting) -> list[Design]:
    """Return the designs to compare.

    Args:
        costs: Those of full gradients and full parameters.
        setting: Without shards and relays.

    Raises:
        InvalidValueError: The costs are of rollouts.
    """
    full = costs.adapted(learn_from="gradients", compress="fp32", parameters_form="full")
    small = costs.adapted(learn_from="gradients", compress="int8", parameters_form="delta")
    rollouts = costs.adapted(learn_from="rollouts", parameters_form="delta")
    sharded, relayed = replace(setting, shards=SHARDS), replace(setting, fan_out=FAN_OUT)
    return [
        Design("fp32 gradients", full, setting),
        Design("int8 gradients, deltas", small, setting),
        Design("rollouts, deltas", rollouts, setting),
        Design(f"{SHARDS} learners", small, sharded),
        Design(f"relays, {FAN_OUT} each", small, relayed),
        Design(f"{SHARDS} learners and relays", small, replace(sharded, fan_out=FAN_OUT)),
    ]
