"""How many threads torch computes with in this process."""

import torch


def use_one_thread() -> None:
    """Let torch compute with one thread from now on.

    One thread adds up the same way every time, so results do not depend on the number of cores. Small products gain
    nothing from more, and the cores belong to other processes: actors, or runs at the same time.
    """
    torch.set_num_threads(1)
