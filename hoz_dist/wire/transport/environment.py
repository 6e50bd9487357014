"""What a launcher puts into the environment of the processes that it starts."""

import os


def child_environment() -> dict[str, str]:
    """Return this process's environment with the settings that learners and actors should run under.

    They must be set before a process starts: Zenoh, OpenMP and the memory allocator read them once. What the user has
    set already stays.
    """
    return _SETTINGS | os.environ


_SETTINGS = {
    # Zenoh has two receive threads by default. A router and its clients in one process that exchange large messages can
    # fill both with blocked work, so that keep-alives are missed and transports close; with eight that did not occur.
    "ZENOH_RUNTIME": "(rx: (worker_threads: 8))",
    # Several processes share few cores: OpenMP threads that spin while they wait take them from the others.
    "OMP_WAIT_POLICY": "PASSIVE",
    "OMP_NUM_THREADS": "1",
    # Messages of megabytes come and go all the time. By default malloc gets each from the kernel and returns it, and
    # the page faults cost more than the copying (40 MB messages: 217 against 802 MB/s). Keep the memory instead.
    "MALLOC_MMAP_MAX_": "0",
    "MALLOC_TRIM_THRESHOLD_": "4000000000",
    "MALLOC_TOP_PAD_": "134217728",
    # Kept memory is kept per arena, and threads take turns in up to eight of them for each core: a router whose clients
    # came and went grew from 25 to 70 MB, and stayed at 25 MB with one; pushes became faster by a quarter as well.
    "MALLOC_ARENA_MAX": "1",
}
