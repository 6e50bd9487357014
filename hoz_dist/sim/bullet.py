"""PyBullet, imported without its greeting: a line on standard error that would garble error messages and logs."""

import os
import sys

__all__ = ["pybullet"]

sys.stderr.flush()
_saved = os.dup(2)
_null = os.open(os.devnull, os.O_WRONLY)
try:
    os.dup2(_null, 2)
    import pybullet
finally:
    os.dup2(_saved, 2)
    os.close(_saved)
    os.close(_null)
