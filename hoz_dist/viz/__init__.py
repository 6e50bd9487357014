"""Figures: zones of graphs, and trajectories from above."""
