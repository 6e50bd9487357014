"""Benchmarks: how fast each part is, beside the limit that the machine sets. One module per benchmark.

A benchmark's limit is measured in the same run and in turns with the figure, because machines are shared and noisy.
Processes are started by `hoz_dist.cli` only; here is what they do.
"""
