"""The wire: `protocol` (what travels), `transport` (Zenoh), and on these `serving`, `client` and `membership`.

The only package that imports zenoh. It knows nothing of policies, simulators or graphs beyond their arrays.
"""
