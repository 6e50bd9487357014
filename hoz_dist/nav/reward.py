"""The reward of the released protocol."""

from typing import Final

STEP_REWARD: Final = -0.01
"""For every action."""
SUCCESS_REWARD: Final = 5.0
"""Added when Done is said at a pose that succeeds."""
