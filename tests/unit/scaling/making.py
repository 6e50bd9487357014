"""Costs and settings of which one can tell by hand what comes of them."""

from typing import Any

from hoz_dist.scaling.costs import Costs
from hoz_dist.scaling.setting import Setting

NOTHING: dict[str, Any] = dict.fromkeys(
    ("act", "differentiate", "load", "push", "fetch", "actor_wire", "receive", "apply", "publish", "serve", "record"),
    0.0,
)


def costs(**values: Any) -> Costs:
    """Costs of 1000 parameters and 100 frames an update; nothing takes time but what is given."""
    nothing = NOTHING | {
        "learner_wire": 0.0,
        "notify": 0.0,
        "notify_wire": 0.0,
        "fixed": 0.0,
        "gil": 0.0,
        "switching": 0.0,
    }
    about = {"preset": "compact", "machine": "none", "command": "none"}
    return Costs(**(about | {"parameters": 1000, "frames": 100.0} | nothing | values))


def setting(**values: Any) -> Setting:
    """Many cores, no latency and links that do not matter."""
    return Setting(**({"actors": 1, "cores": 4096, "latency": 0.0, "bandwidth": 1e15, "max_lag": 100_000} | values))
