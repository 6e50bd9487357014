"""What describes a method; imports nothing heavy, so that ``--help`` and configurations can ask for it."""

from dataclasses import dataclass
from typing import Literal

Method = Literal["a3c", "object", "sp", "savn", "org", "org-tpn", "hoz", "hoz-tpn"]
"""The trained methods."""
Layer = Literal["object", "sp", "org", "scene", "zone", "done", "savn", "tpn"]
"""The layers that a method adds to the network that all share; each can be switched off.

Object branches, of which a network has at most one (`hoz_dist.policy.branches`): ``object``, ``sp``, ``org``.
Steerings, likewise (`hoz_dist.policy.steerings`): ``savn``, ``tpn``. Besides, ``scene`` and ``zone`` layer, and
``done``, the done reminder.
"""


@dataclass(frozen=True, kw_only=True)
class Description:
    """A method: what it adds to picture, target indicator, previous action, LSTM and heads."""

    name: Method
    summary: str
    """What guides the agent, in some words, for lists of methods."""
    layers: tuple[Layer, ...]
    paper: str
    """Where it is published, and the section or equation that counts here."""
