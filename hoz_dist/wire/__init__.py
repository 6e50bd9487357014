"""The wire: key expressions, messages, their codec, and Zenoh sessions.

The only package that imports zenoh. It knows nothing of policies, simulators or graphs beyond their arrays.
"""
