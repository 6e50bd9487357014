"""Real `hoz-dist` processes with keys made by `hoz-dist keys`, as docs/security.md says."""

import json
import signal
import threading
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from hoz_dist.cli.main import run
from hoz_dist.client import HozClient
from hoz_dist.errors import ConnectionFailedError
from hoz_dist.wire.protocol.answers import Accepted
from hoz_dist.wire.transport.credentials import load_credentials
from hoz_dist.wire.transport.session import open_client
from tests.integration.commands import HozDist, hoz_dist
from tests.integration.learning import CONFIG, graph_of
from tests.integration.security.network import free_endpoint
from tests.waiting import until
from workers.link import LearnerLink

pytestmark = pytest.mark.integration


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def keys(tmp_path: Path, endpoint: str) -> Path:
    """Keys for one of each role."""
    folder = tmp_path / "keys"
    assert run(["keys", "init", str(folder)]) == 0
    issue(folder, "router", "r0", "--listen", endpoint)
    for role, name in [("learner", "l0"), ("actor", "a0"), ("viewer", "v0")]:
        issue(folder, role, name)
    return folder


def issue(folder: Path, role: str, name: str, *options: str) -> None:
    assert run(["keys", "issue", role, name, "--authority", str(folder), *options]) == 0


def answers(endpoint: str, folder: Path) -> bool:
    """Tell whether a learner answers the holder of a key; False also when the router does not run yet."""
    try:
        with HozClient(endpoint, credentials=load_credentials(folder)) as client:
            return client.runs() == ["lab"]
    except ConnectionFailedError:
        return False


@pytest.mark.parametrize("where", ["in-the-learner", "as-a-process"])
def test_a_run_with_keys_from_end_to_end(where: str, tmp_path: Path, endpoint: str, keys: Path) -> None:
    common = ("--run", str(tmp_path / "lab"), "--zones", str(CONFIG.zones), "--checkpoint-seconds", "1")
    viewer, stop = str(keys / "viewer-v0"), threading.Event()
    with ExitStack() as stack:
        if where == "in-the-learner":
            place = ["--listen", endpoint, "--keys", str(keys / "router-r0")]
        else:
            place = ["--connect", endpoint, "--keys", str(keys / "learner-l0")]
            words = ("router", "--config", str(keys / "router-r0" / "router.json5"))
            stack.enter_context(HozDist(*words, log=tmp_path / "router.log"))
        learner = stack.enter_context(HozDist("learner", *place, *common, log=tmp_path / "learner.log"))
        until(lambda: answers(endpoint, keys / "viewer-v0"), "an answer to a viewer")
        with (
            open_client(endpoint, credentials=load_credentials(keys / "actor-a0")) as session,
            LearnerLink(session, "a0", None, stop) as link,
            HozClient(endpoint, credentials=load_credentials(viewer)) as client,
        ):
            assert isinstance(link.push_room_graph(graph_of("kitchen/3")), Accepted)
            parameters = link.parameters()
            gradient = np.full(parameters.vector.size, 1e-3, np.float32)
            assert isinstance(link.push_gradient(gradient, 20, parameters.head.stamp), Accepted)
            assert link.parameters((parameters.head.epoch, 1)).head.version == 1
            until(lambda: client.status()["version"] == 1, "the new version")
            assert client.graph("kitchen").rooms == ("kitchen/3",)
            assert client.plan("kitchen", "Sink", ["Fridge"]).path
            members = {(process["role"], process["id"]) for process in client.status()["processes"]}
            assert ("actor", "a0") in members
            if where == "as-a-process":
                assert ("learner", "l0") in members
            as_viewer = ("--connect", endpoint, "--keys", viewer)
            assert json.loads(hoz_dist("query", "kitchen", *as_viewer, "--format", "json").stdout)["version"] == 1
            assert json.loads(hoz_dist("status", *as_viewer, "--json").stdout)["version"] == 1
        assert learner.stop(signal.SIGTERM) == 0
        secrets = [(keys / folder / "key.pem").read_text().splitlines()[1] for folder in ("router-r0", "learner-l0")]
        logs = "".join(path.read_text(errors="replace") for path in tmp_path.rglob("*.log"))
        assert not [secret for secret in secrets if secret in logs]
        assert "PRIVATE" not in logs


def test_a_router_knows_a_new_name_and_a_withdrawn_one_after_it_was_started_again(
    tmp_path: Path, endpoint: str, keys: Path
) -> None:
    words = ("router", "--listen", endpoint, "--keys", str(keys / "router-r0"))
    late = keys / "viewer-late"

    place = ("--connect", endpoint, "--keys", str(keys / "learner-l0"), "--run", str(tmp_path / "lab"))
    with HozDist("learner", *place, log=tmp_path / "learner.log"):
        with HozDist(*words, log=tmp_path / "first.log") as router:
            until(lambda: answers(endpoint, keys / "viewer-v0"), "an answer to a viewer")
            issue(keys, "viewer", "late")
            assert not answers(endpoint, late), "a running router does not read its file again"
            copy = (keys / "viewer-v0").rename(tmp_path / "stolen")
            assert run(["keys", "withdraw", "viewer", "v0", "--authority", str(keys)]) == 0
            assert answers(endpoint, copy)
            assert router.stop(signal.SIGTERM) == 0
        with HozDist(*words, log=tmp_path / "second.log"):
            until(lambda: answers(endpoint, late), "an answer to the new viewer")
            assert not answers(endpoint, copy)


def test_an_actor_goes_by_the_name_of_its_key(tmp_path: Path, endpoint: str, keys: Path) -> None:
    def actor(*options: str) -> tuple[int, str]:
        done = hoz_dist("actor", "--scene", "kitchen", "--connect", endpoint, *options)
        return done.returncode, done.stderr

    key = str(keys / "actor-a0")
    status, said = actor("--keys", key, "--name", "a1")
    assert status == 2
    assert said == (
        f"hoz-dist: The key in '{key}' is of the actor 'a0', so that it cannot be 'a1'; "
        "leave out --name, or give the key of that name.\n"
    )
    status, said = actor("--keys", str(keys / "viewer-v0"))
    assert status == 2
    assert "is of the viewer 'v0'; this needs one of the role actor." in said
    status, said = actor("--keys", key)
    assert status == 2
    assert said.startswith(f"hoz-dist: No router at {endpoint} lets us in")
