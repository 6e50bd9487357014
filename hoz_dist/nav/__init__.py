"""The words of object-goal navigation: categories, actions, poses, episodes, rewards and metrics.

Pure data and arithmetic: no file, network, simulator or learning library.
"""
