"""Zenoh as we use it: sessions and their settings, keys, queries, publications, shared memory."""
