"""What all methods keep to, and what those beyond HOZ's own compute."""

import hashlib
from typing import get_args

import pytest
import torch

from hoz_dist.config import RunConfig
from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.layers_org import RelationLayer
from hoz_dist.policy.layers_sp import PriorLayer
from hoz_dist.policy.methods import METHODS
from hoz_dist.policy.methods.description import Layer, Method
from hoz_dist.policy.parameters import initial_parameters, make_policy
from hoz_dist.policy.relations import relation_matrix
from tests.unit.policy.making import make_observation, step_of


def test_every_method_has_its_name_and_layers_that_exist() -> None:
    assert set(METHODS) == set(get_args(Method))
    for name, method in METHODS.items():
        assert method.name == name
        assert set(method.layers) <= set(get_args(Layer))


@pytest.mark.parametrize(("method", "digest"), [("a3c", "54a0629a"), ("object", "03451a09"), ("hoz", "ad0d1316")])
def test_the_layout_of_parameters_does_not_change_by_accident(method: Method, digest: str) -> None:
    """A checkpoint holds one vector: it means the same as long as the shapes and their order do.

    They changed once on purpose, when the action embedding got rows for what failed. Who changes them again makes all
    checkpoints unreadable: they are refused, and `CHANGELOG.md` has to say so.
    """
    shapes = [tuple(parameter.shape) for parameter in make_policy(RunConfig(method=method).policy, 0).parameters()]
    assert hashlib.sha256(repr(shapes).encode()).hexdigest()[:8] == digest


def observed() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Detections, appearance and targets of three pictures."""
    observation = make_observation(3)
    target = torch.eye(len(TARGETS))[torch.from_numpy(observation.target)]
    return torch.from_numpy(observation.detections), torch.from_numpy(observation.appearance), target


def test_relation_layer_is_relu_of_a_x_w_times_the_appearance() -> None:
    """[Du et al. 2020, 3.2], one category after the other."""
    layer = RelationLayer(RunConfig(method="org").policy)
    detections, appearance, target = observed()
    with torch.no_grad():
        found = layer(detections, appearance, target)
        for b in range(3):
            x = torch.cat([detections[b], target[b, :, None]], dim=1)
            attended = torch.relu(layer.adjacency @ x @ layer.weight) @ appearance[b]
            for category in range(len(TARGETS)):
                row = torch.cat([attended[category], x[category]])
                expected = torch.relu(layer.map(torch.relu(layer.hidden(row))))
                torch.testing.assert_close(found[b, :, category], expected, atol=1e-5, rtol=1e-4)


def test_prior_layer_is_three_graph_convolutions_over_scores_and_categories() -> None:
    """[Yang et al. 2019, 3.2], with W_0 of the joined node features."""
    settings = RunConfig(method="sp").policy
    layer = PriorLayer(settings)
    matrix = torch.from_numpy(relation_matrix(settings.relations)).float()
    scale = torch.diag(matrix.sum(1) ** -0.5)
    normalized = scale @ matrix @ scale
    detections, appearance, target = observed()
    first = torch.cat([layer.first_scores.weight, layer.first_categories.weight], dim=1)
    with torch.no_grad():
        found = layer(detections, appearance, target)
        for b in range(3):
            scores = torch.relu(layer.scores(detections[b, :, 4]))
            nodes = torch.cat([scores.expand(len(TARGETS), -1), layer.categories], dim=1)
            nodes = torch.relu(normalized @ nodes @ first.T)
            nodes = torch.relu(normalized @ nodes @ layer.second.weight.T)
            expected = layer.map((normalized @ nodes @ layer.third.weight.T).squeeze(1))
            torch.testing.assert_close(found[b], expected, atol=1e-5, rtol=1e-4)


def test_the_relations_are_part_of_the_network_but_no_parameters() -> None:
    few = RunConfig(method="sp", relations=("Bowl+Plate",))
    shipped = RunConfig(method="sp")
    assert (initial_parameters(few.policy, 0) == initial_parameters(shipped.policy, 0)).all()
    observation = step_of(make_observation(2, 4), 0)
    logits = []
    for config in (few, shipped):
        policy = make_policy(config.policy, 0)
        # Without the zone layer the scene graphs are not looked at.
        logits.append(policy.act(observation, policy.initial_state(4), bank=None).logits)  # type: ignore[arg-type]
    assert not torch.allclose(logits[0], logits[1])
