"""Gradient codecs: what an actor sends of a gradient, what it keeps for later, and what the learner makes of it."""
