"""`hoz-dist` as a child of `hoz-dist train`: the same command, but it stops when its parent dies, however it dies.

python -m hoz_dist.cli.child PARENT[:SIGNAL] COMMAND...
"""

import ctypes
import os
import signal
import sys
from typing import Final

_PR_SET_PDEATHSIG: Final = 1
"""Linux's prctl option: the signal that a process gets when its parent dies."""


def die_with_parent(parent: int, number: int = signal.SIGTERM) -> None:
    """Ask Linux to stop this process when its parent dies; elsewhere a killed parent leaves it running.

    Args:
        parent: Process id of the parent, which may have died already.
        number: Signal that this process then gets.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
        if os.getppid() != parent:
            sys.exit(1)


if __name__ == "__main__":
    die_with_parent(*map(int, sys.argv.pop(1).split(":")))

    from hoz_dist.cli.main import main  # only now: the parent may die before this is done

    main()
