import base64
import shutil
import stat
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import kubernetes_validate
import pytest
import yaml

from hoz_dist import __version__
from hoz_dist.cli.main import run
from hoz_dist.wire.transport.credentials import load_credentials
from tests.unit.deploy.reading import DEPLOY, commands_in, compose_file, filled_in, parse

KUBECTL = shutil.which("kubectl") or ""
pytestmark = pytest.mark.skipif(not KUBECTL, reason="kubectl, which builds the manifests, is not installed")
OLDEST = "1.27"
"""Of Kubernetes: the first with all that is used."""
Object = Mapping[str, Any]


class Manifests(NamedTuple):
    """What an overlay builds."""

    overlay: str
    objects: list[Object]

    def of(self, *kinds: str) -> list[Object]:
        return [one for one in self.objects if one["kind"] in kinds]

    def named(self, kind: str, name: str) -> Object:
        (found,) = [one for one in self.of(kind) if one["metadata"]["name"] == name]
        return found

    @property
    def workloads(self) -> list[Object]:
        return self.of("Deployment", "StatefulSet")

    @property
    def pods(self) -> list[Object]:
        """The templates of the workloads' pods."""
        return [one["spec"]["template"] for one in self.workloads]

    def containers(self) -> Iterator[tuple[Object, Object]]:
        """Give each container with its pod's specification."""
        for pod in self.pods:
            for container in [*pod["spec"].get("initContainers", ()), *pod["spec"]["containers"]]:
                yield pod["spec"], container


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of deploy/ in which the keys of docs/deploy.md have been issued."""
    copy = tmp_path_factory.mktemp("hoz") / "deploy"
    shutil.copytree(DEPLOY, copy, ignore=shutil.ignore_patterns("keys"))
    keys = str(copy / "kubernetes" / "overlays" / "secure" / "keys")
    for words in (
        ["init", keys],
        ["issue", "router", "router", "--host", "router", "--at", "/keys", "--authority", keys],
        ["issue", "learner", "learner-0", "learner-1", "--authority", keys],
        ["issue", "actor", "actor-0", "actor-1", "actor-2", "actor-3", "--authority", keys],
    ):
        assert run(["keys", *words]) == 0
    return copy


def build(folder: Path, overlay: str) -> Manifests:
    path = folder / "kubernetes" / "overlays" / overlay
    built = subprocess.run([KUBECTL, "kustomize", path], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return Manifests(overlay, list(yaml.safe_load_all(built.stdout)))


@pytest.fixture(scope="module", params=["dev", "secure"])
def manifests(request: pytest.FixtureRequest, folder: Path) -> Manifests:
    return build(folder, request.param)


@pytest.fixture(scope="module")
def secure(folder: Path) -> Manifests:
    return build(folder, "secure")


def matches(selector: Object, labels: Object) -> bool:
    return selector.items() <= labels.items()


@pytest.mark.parametrize("version", [OLDEST, kubernetes_validate.latest_version()])
def test_objects_follow_the_schema_of_kubernetes(manifests: Manifests, version: str) -> None:
    for one in manifests.objects:
        kubernetes_validate.validate(one, version, strict=True)


def test_selectors_match_what_they_mean(manifests: Manifests) -> None:
    labels = [pod["metadata"]["labels"] for pod in manifests.pods]
    for one in manifests.workloads:
        assert matches(one["spec"]["selector"]["matchLabels"], one["spec"]["template"]["metadata"]["labels"])
    selectors = [one["spec"]["selector"] for one in manifests.of("Service")]
    selectors += [one["spec"]["selector"]["matchLabels"] for one in manifests.of("PodDisruptionBudget")]
    for selector in selectors:
        assert sum(matches(selector, one) for one in labels) == 1
    for one in manifests.of("NetworkPolicy"):
        assert any(matches(one["spec"]["podSelector"]["matchLabels"], pod) for pod in labels)
    for one in manifests.of("StatefulSet"):
        assert manifests.named("Service", one["spec"]["serviceName"])


def test_the_service_leads_to_the_routers_port(manifests: Manifests) -> None:
    (port,) = manifests.named("Service", "router")["spec"]["ports"]
    (container,) = manifests.named("Deployment", "router")["spec"]["template"]["spec"]["containers"]
    ports = {one["name"]: one["containerPort"] for one in container["ports"]}
    assert port["port"] == ports[port["targetPort"]] == 7447


def test_containers_may_do_little(manifests: Manifests) -> None:
    for pod, container in manifests.containers():
        assert pod["securityContext"]["runAsNonRoot"]
        assert pod["securityContext"]["runAsUser"] == 10001
        assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
        assert pod["automountServiceAccountToken"] is False
        assert container["securityContext"] == {
            "allowPrivilegeEscalation": False,
            "readOnlyRootFilesystem": True,
            "capabilities": {"drop": ["ALL"]},
        }
        assert container["resources"]["requests"].keys() >= {"cpu", "memory"}
        assert "memory" in container["resources"]["limits"]


def test_what_is_mounted_is_there(manifests: Manifests) -> None:
    named = {(one["kind"], one["metadata"]["name"]) for one in manifests.objects}
    for pod, container in manifests.containers():
        volumes = {volume["name"]: volume for volume in pod["volumes"]}
        paths = [mount["mountPath"] for mount in container["volumeMounts"]]
        assert len(set(paths)) == len(paths)
        assert {mount["name"] for mount in container["volumeMounts"]} <= volumes.keys()
        for volume in volumes.values():
            match volume:
                case {"configMap": {"name": name}}:
                    assert ("ConfigMap", name) in named
                case {"secret": {"secretName": name, "defaultMode": mode}}:
                    assert ("Secret", name) in named
                    # The pod's group reads it, nobody else.
                    assert mode == stat.S_IRUSR | stat.S_IRGRP
                case {"persistentVolumeClaim": {"claimName": name}}:
                    assert ("PersistentVolumeClaim", name) in named
                case _:
                    assert "emptyDir" in volume


def test_shared_memory_is_memory(manifests: Manifests) -> None:
    for pod in manifests.of("StatefulSet"):
        spec = pod["spec"]["template"]["spec"]
        (mount,) = [one for one in spec["containers"][0]["volumeMounts"] if one["mountPath"] == "/dev/shm"]  # noqa: S108
        (volume,) = [one for one in spec["volumes"] if one["name"] == mount["name"]]
        assert volume["emptyDir"]["medium"] == "Memory"


def test_probes_exist_where_they_tell_something(manifests: Manifests) -> None:
    probes = {
        one["metadata"]["name"]: {
            key for key in one["spec"]["template"]["spec"]["containers"][0] if key.endswith("Probe")
        }
        for one in manifests.workloads
    }
    assert probes == {
        "router": {"startupProbe", "readinessProbe", "livenessProbe"},
        "learner": {"readinessProbe", "livenessProbe"},
        # A waiting actor must not be restarted.
        "actor": {"readinessProbe"},
    }


def test_commands_exist(manifests: Manifests) -> None:
    for one in manifests.of("StatefulSet"):
        (container,) = one["spec"]["template"]["spec"]["containers"]
        values = {"POD_NAME": "pod-0"} | {env["name"]: env["value"] for env in container["env"] if "value" in env}
        parse(filled_in(container["args"], values))
        for probe in (value for key, value in container.items() if key.endswith("Probe")):
            shell, flag, script = probe["exec"]["command"]
            assert (shell, flag) == ("sh", "-c")
            (words,) = commands_in(script)
            parse(filled_in(words, values))


def test_everybody_is_encrypted_or_nobody(manifests: Manifests) -> None:
    text = yaml.safe_dump_all(manifests.of("StatefulSet"))
    protocol, other = ("tls/", "tcp/") if manifests.overlay == "secure" else ("tcp/", "tls/")
    assert text.count(f"{protocol}router:7447") == 2
    assert other not in text
    probes = [
        value["exec"]["command"][-1]
        for _, container in manifests.containers()
        for key, value in container.items()
        if key.endswith("Probe") and "exec" in value
    ]
    assert all(("--keys /keys" in probe) == (manifests.overlay == "secure") for probe in probes)


def test_two_learners_share_the_run(secure: Manifests) -> None:
    learner = secure.named("StatefulSet", "learner")["spec"]
    assert learner["replicas"] == 2
    assert "--standby" in learner["template"]["spec"]["containers"][0]["args"]
    assert secure.named("PersistentVolumeClaim", "runs")["spec"]["accessModes"] == ["ReadWriteMany"]
    # An update waits until the one that was restarted stands by.
    assert learner["minReadySeconds"] >= 10
    assert learner["template"]["spec"]["terminationGracePeriodSeconds"] >= 30


def test_one_actor_to_try_it(manifests: Manifests) -> None:
    replicas = manifests.named("StatefulSet", "actor")["spec"]["replicas"]
    assert replicas == (4 if manifests.overlay == "secure" else 1)


def test_only_clients_reach_the_router_and_nobody_else_is_reached(manifests: Manifests) -> None:
    policies = {one["metadata"]["name"]: one["spec"] for one in manifests.of("NetworkPolicy")}
    labels = {one["metadata"]["name"]: one["spec"]["template"]["metadata"]["labels"] for one in manifests.workloads}
    # Everything is denied to everybody first.
    assert all(matches(policies["deny"]["podSelector"]["matchLabels"], one) for one in labels.values())
    assert set(policies["deny"]["policyTypes"]) == {"Ingress", "Egress"}
    assert "ingress" not in policies["deny"]
    assert "egress" not in policies["deny"]
    # Then one way in is opened: the router's, for clients.
    (way_in,) = [one for one in policies.values() if "ingress" in one]
    reached = [name for name, one in labels.items() if matches(way_in["podSelector"]["matchLabels"], one)]
    assert reached == ["router"]
    (rule,) = way_in["ingress"]
    (source,) = rule["from"]
    clients = {name for name, one in labels.items() if matches(source["podSelector"]["matchLabels"], one)}
    assert clients == {"learner", "actor"}
    assert rule["ports"] == [{"port": 7447, "protocol": "TCP"}]
    # And clients get out to it.
    let_out = {name for name, one in labels.items() if matches(policies["client"]["podSelector"]["matchLabels"], one)}
    assert let_out == clients
    to_router = policies["client"]["egress"][0]
    assert matches(to_router["to"][0]["podSelector"]["matchLabels"], labels["router"])
    assert to_router["ports"] == rule["ports"]


def test_another_pod_that_is_a_client_may_talk_to_whom_it_likes(manifests: Manifests) -> None:
    bridge = {"app": "bridge", "hoz-dist/client": "true"}
    for one in manifests.of("NetworkPolicy"):
        assert not matches(one["spec"]["podSelector"]["matchLabels"], bridge)


def test_images_are_of_this_version(manifests: Manifests) -> None:
    images = {container["image"] for _, container in manifests.containers()}
    assert images == {f"hoz-dist:{__version__}", compose_file("compose.yaml")["services"]["router"]["image"]}


@pytest.mark.parametrize(("workload", "pod"), [("learner", "learner-1"), ("actor", "actor-3")])
def test_each_pod_gets_its_own_key_and_no_other(secure: Manifests, tmp_path: Path, workload: str, pod: str) -> None:
    spec = secure.named("StatefulSet", workload)["spec"]["template"]["spec"]
    (volume,) = [one for one in spec["volumes"] if "secret" in one]
    pool, keys = tmp_path / "pool", tmp_path / "keys"
    pool.mkdir()
    keys.mkdir()
    for name, content in secure.named("Secret", volume["secret"]["secretName"])["data"].items():
        (pool / name).write_bytes(base64.b64decode(content))
    shell, flags, script = spec["initContainers"][0]["command"]
    script = script.replace("/pool/", f"{pool}/").replace("/keys/", f"{keys}/")
    subprocess.run([f"/bin/{shell}", flags, script], env={"POD_NAME": pod, "PATH": "/bin:/usr/bin"}, check=True)
    found = load_credentials(keys, [workload])
    assert found.name == pod
    assert {path.name for path in keys.iterdir()} == {"ca.pem", "certificate.pem", "key.pem"}
    # The process itself does not see the pool.
    assert "pool" not in {mount["name"] for mount in spec["containers"][0]["volumeMounts"]}


def test_every_pod_of_the_sets_has_a_key(secure: Manifests) -> None:
    for one in secure.of("StatefulSet"):
        (volume,) = [volume for volume in one["spec"]["template"]["spec"]["volumes"] if "secret" in volume]
        data = secure.named("Secret", volume["secret"]["secretName"])["data"]
        name = one["metadata"]["name"]
        for number in range(one["spec"]["replicas"]):
            assert {f"{name}-{number}.key.pem", f"{name}-{number}.certificate.pem"} <= data.keys()


def test_the_routers_file_finds_its_keys_where_they_are_mounted(secure: Manifests) -> None:
    spec = secure.named("Deployment", "router")["spec"]["template"]["spec"]
    (volume,) = spec["volumes"]
    data = secure.named("Secret", volume["secret"]["secretName"])["data"]
    (container,) = spec["containers"]
    (mount,) = container["volumeMounts"]
    file = base64.b64decode(data["router.json5"]).decode()
    assert container["args"] == ["--config", f"{mount['mountPath']}/router.json5"]
    for name in data.keys() - {"router.json5"}:
        assert f'"{mount["mountPath"]}/{name}"' in file
    # And the file for trusted networks is not there.
    assert secure.of("ConfigMap") == []
