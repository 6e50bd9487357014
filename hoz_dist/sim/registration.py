"""Makes `hoz_dist/ObjectNav-v0` known to Gymnasium.

Import this module, or let Gymnasium do so: ``gymnasium.make("hoz_dist.sim.registration:hoz_dist/ObjectNav-v0")``.
`register` is also what the entry point in the group ``gymnasium.envs`` names; Gymnasium itself has not called such
entry points since its version 1.0, but other tools look environments up there.
"""

from typing import Final

import gymnasium

ENVIRONMENT_ID: Final = "hoz_dist/ObjectNav-v0"


def register() -> None:
    """Register the environment; doing so again changes nothing."""
    if ENVIRONMENT_ID not in gymnasium.registry:
        gymnasium.register(id=ENVIRONMENT_ID, entry_point="hoz_dist.sim.gym_env:ObjectNavEnv")


register()
