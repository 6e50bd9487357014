"""The simulator: rooms made from their names, the PyBullet world and camera, what an agent can do and see in them."""
