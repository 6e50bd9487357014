"""A run behind a router with access control, and everybody who has a key for it."""

import json
import socket
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Final

import zenoh

from hoz_dist.security.key_folders import RouterPlace, create_authority, issue_keys, withdraw_key
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.protocol.codec import checksum, encode
from hoz_dist.wire.protocol.pushes import Push
from hoz_dist.wire.serving.parameters import ParametersPublisher
from hoz_dist.wire.serving.server import Server
from hoz_dist.wire.serving.snapshots import Snapshots
from hoz_dist.wire.transport.ask import Answer, ask
from hoz_dist.wire.transport.credentials import ROUTER_FILE, Credentials, load_credentials
from hoz_dist.wire.transport.session import Session, open_client, open_router
from hoz_dist.wire.transport.settings import CLIENT_LEASE_MS, client_settings, tls_settings
from tests import wire_samples as samples
from tests.integration.commands import HozDist
from tests.integration.wire.pushing import answering
from tests.waiting import until

KEYS: Final = samples.KEYS
DAY: Final = timedelta(days=1)
ROUTERS: Final = ("in-the-learner", "as-a-process")
"""Both kinds of routers: the learner's own session, and `hoz-dist router` with the file that zenohd would be given."""


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tls/127.0.0.1:{probe.getsockname()[1]}"


def issue_all(folder: Path) -> dict[str, str]:
    """Make an authority and everybody's keys; returns the endpoints of the routers."""
    create_authority(folder)
    # A viewer whose key was withdrawn; whoever stole it before still has it.
    [(_, gone)] = issue_keys(folder, "viewer", ["gone"], DAY)
    gone.rename(folder / "withdrawn")
    withdraw_key(folder, "viewer", "gone")
    for role, names in {"learner": ["l0", "l1"], "actor": ["a0", "a1"], "viewer": ["v0"]}.items():
        issue_keys(folder, role, names, DAY)
    endpoints = {name: free_endpoint() for name in ROUTERS}
    for name, endpoint in endpoints.items():
        issue_keys(folder, "router", [name], DAY, RouterPlace(listen=(endpoint,)))
    return endpoints


@dataclass(frozen=True)
class Network:
    """A router, and a learner of it that accepts whatever reaches it."""

    endpoint: str
    folder: Path
    learner: Session
    parameters: ParametersPublisher
    server: Server
    came: Sequence[Push]
    """The pushes that reached the learner."""

    def credentials(self, holder: str) -> Credentials:
        return load_credentials(self.folder / holder)

    def open(self, holder: str) -> Session:
        return open_client(self.endpoint, timeout_s=10.0, credentials=self.credentials(holder))

    def open_as(self, holder: str, mode: str) -> Session:
        """Open a session that is not content to be a client."""
        keys = self.credentials(holder)
        settings = client_settings(CLIENT_LEASE_MS) | tls_settings(keys.authority, keys.certificate, keys.key)
        settings |= {"mode": mode, "connect/endpoints": [self.endpoint], "listen/endpoints": []}
        config = zenoh.Config()
        for path, value in settings.items():
            config.insert_json5(path, json.dumps(value))
        return zenoh.open(config)

    def ask(self, session: Session, part: str) -> list[Answer]:
        return ask(session, f"hoz/{KEYS.run}/{part}", timeout_s=5.0)

    def push(self, session: Session, key: str, message: Push) -> list[Answer]:
        payload = encode(message)
        return ask(session, key, timeout_s=5.0, payload=payload, attachment=checksum(payload))

    def settle(self, session: Session) -> None:
        """Wait until the router has handled all that a session has sent: messages of a link keep their order."""
        assert self.ask(session, "config")


@contextmanager
def running(kind: str, folder: Path, endpoint: str, log: Path) -> Iterator[Network]:
    router = folder / f"router-{kind}"
    with ExitStack() as stack:
        if kind == "in-the-learner":
            learner = stack.enter_context(open_router(endpoint, load_credentials(router)))
        else:
            process = stack.enter_context(HozDist("router", "--config", str(router / ROUTER_FILE), log=log))
            until(lambda: "Listening" in process.said, "the router")
            credentials = load_credentials(folder / "learner-l0")
            learner = stack.enter_context(open_client(endpoint, timeout_s=10.0, credentials=credentials))
        snapshots = Snapshots(samples.config_reply(), samples.status_reply, "product")
        server = stack.enter_context(Server(learner, KEYS, snapshots, graphs=[samples.scene_graph()]))
        parameters = stack.enter_context(ParametersPublisher(learner, KEYS))
        came = stack.enter_context(answering(server.inbox, lambda _: Accepted(1, 1)))
        yield Network(endpoint, folder, learner, parameters, server, came)
