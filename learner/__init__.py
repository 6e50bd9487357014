"""The learner process: applies gradients, publishes parameters, merges and serves graphs, and checkpoints."""
