"""A3C's arithmetic: rollouts, returns, loss, and the gradients of a policy. Knows of no environment and no wire."""
