"""Designs to compare: what there is, with less on the wire, and what could come next."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

from hoz_dist.scaling.costs import Costs, costs_of
from hoz_dist.scaling.setting import Setting

SHARDS: Final = 16
FAN_OUT: Final = 8


class Design(NamedTuple):
    """One way to run so many actors."""

    name: str
    costs: Costs
    setting: Setting


def designs(measured: Sequence[Costs], setting: Setting) -> list[Design]:
    """Return the designs to compare.

    Args:
        measured: Costs of gradients, and of rollouts if they were measured.
        setting: Without shards and relays.

    Raises:
        InvalidValueError: The costs are of rollouts alone, or all is on one host.
    """
    full = costs_of(measured, "gradients").adapted(compress="fp32", parameters_form="full")
    small = full.adapted(compress="int8", parameters_form="delta")
    rollouts = costs_of(measured, "rollouts").adapted(parameters_form="delta")
    sharded, relayed = replace(setting, shards=SHARDS), replace(setting, fan_out=FAN_OUT)
    return [
        Design("fp32 gradients", full, setting),
        Design("int8 gradients, deltas", small, setting),
        Design(described(rollouts, measured), rollouts, setting),
        Design(f"{SHARDS} learners", small, sharded),
        Design(f"relays, {FAN_OUT} each", small, relayed),
        Design(f"{SHARDS} learners and relays", small, replace(sharded, fan_out=FAN_OUT)),
    ]


def described(costs: Costs, measured: Sequence[Costs]) -> str:
    """Say what is on the wire, and whether the costs are estimated from those of another source."""
    what = "rollouts" if costs.learn_from == "rollouts" else f"{costs.compress} gradients"
    parameters = "deltas" if costs.parameters_form == "delta" else "full parameters"
    is_estimate = costs.learn_from not in {one.learn_from for one in measured}
    return f"{what}, {parameters}" + (" (estimated)" if is_estimate else "")
