"""The learner process: applies gradients, keeps the graphs, publishes parameters, answers queries, checkpoints.

`core` decides (events in, effects out, no I/O); `service` is the shell that carries its decisions out.
"""
