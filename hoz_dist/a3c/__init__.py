"""A3C's arithmetic: rollouts, returns, loss and gradients. Knows of no environment, network or wire."""
