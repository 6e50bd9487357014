"""A long cable: two network devices, each of which gives out what goes into the other, some time later.

Whole IP packets are delayed, so TCP sees delay, loss and rate of one path, as on a real network; a forwarder of bytes
would end the connection and hide them from each other. A process of its own, which says `ready` once the devices
exist; they can then be moved into network namespaces. It needs the rights of root.

    python -m tests.campaigns.delay_line --delay-ms 50 LEFT RIGHT
"""

import fcntl
import os
import select
import struct
import time
from collections import deque
from typing import Final

import click

from hoz_dist.cli.child import die_with_parent

_TUNSETIFF: Final = 0x400454CA
_IFF_TUN: Final = 0x0001
_IFF_NO_PI: Final = 0x1000
"""Packets come without a header of Linux's own."""
LONGEST_PACKET: Final = 65_536
MOST_WAITING: Final = 4096
"""Packets on the cable; at 20 Mbit/s and 50 ms there are about 100."""


def open_device(name: str) -> int:
    """Make a network device and return the file that its packets are read from and written to."""
    file = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(file, _TUNSETIFF, struct.pack("16sH22x", name.encode(), _IFF_TUN | _IFF_NO_PI))
    return file


class Cable:
    """One direction.

    Args:
        source: File that packets come from.
        sink: File that they go to.
        delay_s: How long each takes.
    """

    def __init__(self, source: int, sink: int, delay_s: float) -> None:
        self._source, self._sink, self._delay_s = source, sink, delay_s
        self._packets: deque[tuple[float, bytes]] = deque(maxlen=MOST_WAITING)

    def take_in(self) -> None:
        """Read all packets that are there."""
        while True:
            try:
                packet = os.read(self._source, LONGEST_PACKET)
            except BlockingIOError:
                return
            self._packets.append((time.monotonic() + self._delay_s, packet))

    def give_out(self) -> float:
        """Write all packets that are due; returns the time until the next one, at most a second."""
        while self._packets:
            wait = self._packets[0][0] - time.monotonic()
            if wait > 0:
                return min(wait, 1.0)
            packet = self._packets.popleft()[1]
            try:
                os.write(self._sink, packet)
            except OSError:
                continue  # the other end is down or its queue is full: the packet is lost, as on any cable
        return 1.0


@click.command()
@click.option("--delay-ms", type=float, required=True, help="In each direction.")
@click.argument("left")
@click.argument("right")
def main(delay_ms: float, left: str, right: str) -> None:
    """Carry packets until killed."""
    die_with_parent(os.getppid())
    a, b = open_device(left), open_device(right)
    cables = {a: Cable(a, b, delay_ms / 1000), b: Cable(b, a, delay_ms / 1000)}
    click.echo("ready")
    poll = select.poll()
    for file in cables:
        poll.register(file, select.POLLIN)
    while True:
        wait = min(cable.give_out() for cable in cables.values())
        for file, event in poll.poll(max(1000 * wait, 0.1)):
            if event & select.POLLIN:
                cables[file].take_in()


if __name__ == "__main__":
    main()
