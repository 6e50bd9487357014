"""The side of actors, robots and queries: finds runs, asks, pushes, fetches parameters."""
