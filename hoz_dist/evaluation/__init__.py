"""Evaluation of agents on a fixed list of episodes, every one of which counts."""
