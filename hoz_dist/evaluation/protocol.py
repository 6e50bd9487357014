"""What all tests have in common; imports nothing heavy, so that ``--help`` can tell it."""

from typing import Final

EPISODE_SEED: Final = 2021
"""Seed of the list of episodes: the same list for every agent, trial and run."""
TEMPERATURE: Final = 0.5
"""By which a tested policy's logits are divided: exploring is for training; see docs/decisions/recipe.md."""
