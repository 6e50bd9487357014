"""Who takes part in a run, by liveliness tokens."""
