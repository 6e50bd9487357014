"""Network: an actor on a good link and one on a bad link, and links that are cut for a while.

python -m tests.campaigns.network --folder runs/network --congestion-control cubic
"""

import re
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, Final, Literal

import click

from tests.campaigns.audit import AuditFigures, audit
from tests.campaigns.cluster import ROUTER, Cluster, prepare_views, start
from tests.campaigns.helpers import pause
from tests.campaigns.journals import FrameRate, first_of
from tests.campaigns.namespaces import HUB_FROM_FAR, HUB_FROM_NEAR, BadLink, Network
from tests.campaigns.report import show
from tests.campaigns.supervisor import Supervisor
from tests.waiting import until

LEARNER: Final = "learner-a"
PORT: Final = 7447
"""Namespaces have ports of their own."""
SHARE: Final = 0.8
"""Frames per second of the near actor that must be left while the far one is there."""
HEAL_S: Final = 60.0
JOIN_S: Final = 300.0
"""How long the far actor may take until its first gradient is answered."""
_REFUSED: Final = re.compile(r"a gradient was refused \((\w+)\)")


@dataclass(frozen=True)
class Settings:
    """How bad the network is, and for how long."""

    link: BadLink = field(default_factory=BadLink)
    congestion_control: str = "cubic"
    warm_up_s: float = 45.0
    """How long the near actor trains first: a policy that knows nothing yet makes longer episodes, and more frames."""
    measure_s: float = 60.0
    """How long frames per second are measured, with and without the far actor."""
    cut_s: float = 60.0
    cut_far: bool = True
    """Whether the far actor's link is cut too, after the near one's."""


@dataclass(frozen=True)
class NetworkFigures:
    """What came of it."""

    congestion_control: str
    link: BadLink
    near_frames_per_second_alone: float
    """The median second of the near actor before the far one came and after it left."""
    near_frames_per_second: float
    """While the far one was there."""
    far_first_answer_seconds: float
    """From its start, all its imports included."""
    far_accepted: int
    far_refused: dict[str, int]
    near_heals_seconds: float
    """From the moment at which the link is whole again to the next gradient that is acknowledged."""
    far_heals_seconds: float | None
    """The same; an answer that refuses counts as well. None when its link was not cut."""
    audit: AuditFigures
    wrong: list[str] = field(default_factory=list)
    """What must never be; empty when all is well."""
    late: list[str] = field(default_factory=list)
    """What takes longer than it may."""

    def to_json(self) -> dict[str, Any]:
        """Return the figures."""
        return asdict(self)


def network(folder: Path, cache: Path, settings: Settings) -> NetworkFigures:
    """Train across the links.

    Args:
        folder: For all files; empty or not there.
        cache: The view cache.
        settings: How bad the network is.
    """
    prepare_views(cache)
    with Network(settings.link, settings.congestion_control) as net:

        def place(name: str) -> tuple[str, ...]:
            return net.within(name if name in ("near", "far") else "hub")

        cluster = Cluster(folder, cache, f"tcp/127.0.0.1:{PORT}", place)
        with Supervisor(cluster.logs) as supervisor:
            service = _Service(cluster, supervisor, net)
            start(supervisor, cluster.router(f"tcp/0.0.0.0:{PORT}"), cluster.learner(LEARNER))
            start(supervisor, cluster.actor("near", f"tcp/{HUB_FROM_NEAR}:{PORT}"))
            until(lambda: service.answers("near") > 0, "the near actor to train")
            pause(settings.warm_up_s)
            before = service.measure(settings.measure_s)

            far_began = time.time()
            start(supervisor, cluster.actor("far", f"tcp/{HUB_FROM_FAR}:{PORT}"))
            until(lambda: service.answers("far") > 0, "the far actor's first gradient", JOIN_S)
            far_seconds = time.time() - far_began
            lives = len(supervisor.lives)
            with_far = service.measure(settings.measure_s)

            near_heals = service.cut("near", settings.cut_s)
            far_heals = service.cut("far", settings.cut_s) if settings.cut_far else None
            restarted = [life.program.name for life in supervisor.lives[lives:]]

            supervisor.stop("far")
            after = service.measure(settings.measure_s)
            supervisor.stop("near")
            supervisor.stop(LEARNER)
            supervisor.stop(ROUTER)
    pushes = cluster.acknowledged("near", "far")
    figures = NetworkFigures(
        congestion_control=settings.congestion_control,
        link=settings.link,
        near_frames_per_second_alone=round(median([*before, *after])),
        near_frames_per_second=round(median(with_far)),
        far_first_answer_seconds=round(far_seconds, 1),
        far_accepted=sum(push.actor == "far" and push.kind == "gradient" for push in pushes),
        far_refused=service.refused("far"),
        near_heals_seconds=round(near_heals, 1),
        far_heals_seconds=None if far_heals is None else round(far_heals, 1),
        audit=audit(cluster.run, pushes).figures,
    )
    figures.wrong.extend(figures.audit.problems)
    figures.wrong.extend(f"{name} was started again" for name in restarted)
    if figures.near_frames_per_second < SHARE * figures.near_frames_per_second_alone:
        figures.late.append("the far actor slows the near one down")
    if figures.far_refused.keys() - {"stale", "epoch"}:
        figures.wrong.append(f"gradients of the far actor were refused: {figures.far_refused}")
    if figures.near_heals_seconds > HEAL_S:
        figures.late.append(f"the near actor went on only after {figures.near_heals_seconds} s")
    return figures


class _Service:
    """Looks at what runs."""

    def __init__(self, cluster: Cluster, supervisor: Supervisor, net: Network) -> None:
        self._cluster, self._supervisor, self._net = cluster, supervisor, net

    def refused(self, actor: str) -> dict[str, int]:
        """Return how many gradients of an actor were refused, by reason."""
        reasons = _REFUSED.findall(self._supervisor.said(actor))
        return {reason: reasons.count(reason) for reason in sorted(set(reasons))}

    def answers(self, actor: str) -> int:
        """Return how many gradients of an actor were answered: accepted, or refused by name."""
        accepted = sum(push.kind == "gradient" for push in self._cluster.acknowledged(actor))
        return accepted + sum(self.refused(actor).values())

    def measure(self, seconds: float) -> list[float]:
        """Return the near actor's frames per second, for each second to come."""
        began = time.time()
        pause(seconds)
        return FrameRate(self._cluster.acknowledged("near")).windows(began, began + seconds)

    def cut(self, host: Literal["near", "far"], seconds: float) -> float:
        """Cut a host off for a while; returns how long it took to go on afterwards."""
        self._net.cut(host)
        pause(seconds)
        known = self.answers(host)
        self._net.mend(host)
        mended = time.time()
        until(lambda: self.answers(host) > known, f"{host} to go on", JOIN_S)
        answered = time.time() - mended
        first = first_of(self._cluster.acknowledged(host), host, mended)
        return answered if first is None else min(first, answered)


@click.command()
@click.option("--congestion-control", default="cubic", show_default=True)
@click.option("--megabits", type=float, default=20.0, show_default=True)
@click.option("--delay-ms", type=float, default=50.0, show_default=True, help="In each direction.")
@click.option("--loss-percent", type=int, default=5, show_default=True, help="In each direction.")
@click.option("--measure-seconds", type=float, default=60.0, show_default=True)
@click.option("--cut-seconds", type=float, default=60.0, show_default=True)
@click.option("--folder", type=click.Path(path_type=Path), required=True, help="For all files; a new one.")
def main(
    congestion_control: str,
    megabits: float,
    delay_ms: float,
    loss_percent: int,
    measure_seconds: float,
    cut_seconds: float,
    folder: Path,
) -> None:
    """Train over a bad network and print the figures as JSON."""
    link = BadLink(megabits, delay_ms, loss_percent)
    settings = Settings(link, congestion_control, measure_s=measure_seconds, cut_s=cut_seconds)
    show("NETWORK", network(folder, folder / "views", settings).to_json())


if __name__ == "__main__":
    main()
