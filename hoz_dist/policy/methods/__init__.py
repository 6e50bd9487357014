"""The trained methods, one module each, by name.

A method is a set of layers on one network (`hoz_dist.policy.actor_critic.ActorCritic`). To add one: write its module
with a `Description` here, add its name to `Method`, and list it in `METHODS`. A layer that no method had before gets a
name in `Layer`, and a place where the network asks for it:

- an *object branch*, which looks at detections, appearance and target: `hoz_dist.policy.branches`;
- a *steering*, which may change the logits after the LSTM, remembers things for an episode, and may ask to be taught
  the expert's action: `hoz_dist.policy.steering`, listed in `hoz_dist.policy.steerings`.
"""

from typing import Final

from hoz_dist.policy.methods.a3c import A3C
from hoz_dist.policy.methods.description import Description, Method
from hoz_dist.policy.methods.hoz import HOZ
from hoz_dist.policy.methods.hoz_tpn import HOZ_TPN
from hoz_dist.policy.methods.object import OBJECT
from hoz_dist.policy.methods.org import ORG
from hoz_dist.policy.methods.org_tpn import ORG_TPN
from hoz_dist.policy.methods.savn import SAVN
from hoz_dist.policy.methods.sp import SP

METHODS: Final[dict[Method, Description]] = {
    one.name: one for one in (A3C, OBJECT, SP, SAVN, ORG, ORG_TPN, HOZ, HOZ_TPN)
}
"""Every method, the simplest first, and after a method what adds to it."""
