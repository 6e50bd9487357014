"""Hosts on a network: Linux network namespaces, with a good link and a bad one.

hub  10.77.1.1 --- a pair of virtual Ethernet devices ------------------- 10.77.1.2  near
hub  10.77.2.1 --- 20 Mbit/s (tc tbf), delay (a cable), loss (nftables) - 10.77.2.2  far
"""

import os
import shutil
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from hoz_dist.closing import Closing

HUB_FROM_NEAR: Final = "10.77.1.1"
HUB_FROM_FAR: Final = "10.77.2.1"
_TOOLS: Final = ("ip", "tc", "nft")

Host = Literal["hub", "near", "far"]


def what_is_missing() -> str | None:
    """Say why there can be no namespaces here; None when there can."""
    missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
    if missing:
        return f"needs the commands {', '.join(missing)}"
    if os.geteuid() != 0:
        return "needs the rights of root, for network namespaces"
    if not Path("/dev/net/tun").exists():
        return "needs /dev/net/tun, for a cable that delays"
    try:
        _run("ip", "netns", "add", f"hoz-{os.getpid()}-probe")
        _run("ip", "netns", "delete", f"hoz-{os.getpid()}-probe")
    except subprocess.CalledProcessError as error:
        return f"cannot make network namespaces: {error.stderr.strip()}"
    return None


@dataclass(frozen=True)
class BadLink:
    """What the link to `far` is like, in each direction."""

    megabits: float = 20.0
    delay_ms: float = 50.0
    loss_percent: int = 5


class Network(Closing):
    """Three hosts. Use it in a ``with`` statement; everything is taken down at its end.

    Args:
        link: The link between hub and far.
        congestion_control: Linux's algorithm that TCP uses on all hosts; it has much to do with what loss costs.
    """

    def __init__(self, link: BadLink, congestion_control: str = "cubic") -> None:
        self._names = {host: f"hoz-{os.getpid()}-{host}" for host in ("hub", "near", "far")}
        with ExitStack() as stack:
            for name in self._names.values():
                _run("ip", "netns", "add", name)
                stack.callback(_run, "ip", "netns", "delete", name)
            for host in self._names:
                self._on(host, "ip", "link", "set", "lo", "up")
            self._congestion_control = congestion_control
            self._lay_good_link()
            self._lay_bad_link(link, stack)
            self._open = stack.pop_all()

    def close(self) -> None:
        """Take everything down."""
        self._open.close()

    def within(self, host: str) -> tuple[str, ...]:
        """Return the command that runs another one on a host, and becomes it."""
        return (_path("ip"), "netns", "exec", self._names[host])

    def cut(self, host: Literal["near", "far"]) -> None:
        """Let nothing through between a host and the hub, without a word to either."""
        for end in (host, "hub"):
            self._on(end, "nft", "add", "rule", "inet", "hoz", "cut", "iifname", host, "drop")

    def mend(self, host: Literal["near", "far"]) -> None:
        """Let everything through again."""
        self._on(host, "nft", "flush", "chain", "inet", "hoz", "cut")
        self._on("hub", "nft", "flush", "chain", "inet", "hoz", "cut")

    def _lay_good_link(self) -> None:
        # The device has the same name on both sides: that of the host that is not the hub.
        near, hub = ("near", "netns", self._names["near"]), ("near", "netns", self._names["hub"])
        _run("ip", "link", "add", *near, "type", "veth", "peer", "name", *hub)
        self._raise_link("near", HUB_FROM_NEAR, "10.77.1.2")

    def _lay_bad_link(self, link: BadLink, stack: ExitStack) -> None:
        ends = {"far": f"hozf{os.getpid()}", "hub": f"hozh{os.getpid()}"}
        command = [sys.executable, "-m", "tests.campaigns.delay_line", "--delay-ms", f"{link.delay_ms:g}"]
        cable = subprocess.Popen([*command, ends["far"], ends["hub"]], stdout=subprocess.PIPE, text=True)
        stack.enter_context(cable)
        stack.callback(cable.kill)
        # A real cable does not wait for a busy processor.
        os.setpriority(os.PRIO_PROCESS, cable.pid, -10)
        assert cable.stdout is not None
        if cable.stdout.readline() != "ready\n":
            message = "the cable could not be laid"
            raise RuntimeError(message)
        for host, device in ends.items():
            _run("ip", "link", "set", device, "netns", self._names[host], "name", "far")
        self._raise_link("far", HUB_FROM_FAR, "10.77.2.2")
        for host in ends:
            shape = ("rate", f"{link.megabits:g}mbit", "burst", "32kb", "latency", "100ms")
            self._on(host, "tc", "qdisc", "add", "dev", "far", "root", "tbf", *shape)
            lose = f"iifname far numgen random mod 100 < {link.loss_percent} drop"
            self._on(host, "nft", "add", "rule", "inet", "hoz", "loss", *lose.split())

    def _raise_link(self, device: Literal["near", "far"], hub: str, other: str) -> None:
        for host, address in (("hub", hub), (device, other)):
            self._on(host, "ip", "address", "add", f"{address}/24", "dev", device)
            self._on(host, "ip", "link", "set", device, "up")
            # By route, because namespaces may only choose among what the whole machine allows.
            route = (f"{address.rpartition('.')[0]}.0/24", "dev", device, "src", address)
            self._on(host, "ip", "route", "replace", *route, "congctl", self._congestion_control)
        for host in ("hub", device):
            self._on(host, "nft", "add", "table", "inet", "hoz")
            for chain in ("cut", "loss"):
                hook = "{ type filter hook input priority 0 ; }"
                self._on(host, "nft", "add", "chain", "inet", "hoz", chain, hook)

    def _on(self, host: str, *command: str) -> None:
        _run("ip", "netns", "exec", self._names[host], *command)


def _run(tool: str, *words: str) -> None:
    subprocess.run([_path(tool), *words], check=True, capture_output=True, text=True, timeout=30)


def _path(tool: str) -> str:
    path = shutil.which(tool)
    if path is None:
        message = f"there is no command {tool} here"
        raise FileNotFoundError(message)
    return path
