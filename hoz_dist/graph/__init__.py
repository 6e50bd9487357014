"""Hierarchical object-to-zone graphs: zones of a room, their merge into a scene graph, and plans on it.

From views to plans, one module a step: `views` (what was seen where), `exploration`, `zones` (K-means),
`room_graph` [4.1.1], `matching` and `scene_graph` [4.1.2], `update` [4.2], `planner` [4.3], `files`.

Everything here imports only NumPy; SciPy, scikit-learn and msgpack are loaded by the functions that need them.
"""
