"""Run folders for commands that read them."""

from pathlib import Path

from hoz_dist.config import RunConfig
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.rooms import RoomId
from hoz_dist.policy.parameters import initial_parameters
from hoz_dist.wire.protocol.pushes import RoomGraphPush
from learner.checkpoint import FOLDER, save_checkpoint
from learner.core import LearnerCore
from learner.events import RoomGraphReceived
from tests.integration.learning import graph_of


def save_run(folder: Path, config: RunConfig, *, keep: bool = False) -> Path:
    """Save a run whose agent knows a bathroom's graph and has not learned anything yet; return its folder."""
    core = LearnerCore(config, initial_parameters(config.policy, config.seed))
    graph = graph_of("bathroom/1", zones=config.zones)
    push = RoomGraphPush("a", 1, 0, RoomId("bathroom", 1), graph.digest, TARGETS, graph.nodes, graph.edges)
    core.handle(RoomGraphReceived(0, push), now=0.0)
    save_checkpoint(folder / FOLDER, core.snapshot(0.0), keep=keep)
    return folder
