"""Policies: visual encoders, the layers of the HOZ agent, and the actor-critic network."""
