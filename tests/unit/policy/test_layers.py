import numpy as np
import torch

from hoz_dist.graph.update import current_zone, update
from hoz_dist.nav.actions import Action
from hoz_dist.policy.layers import DoneReminder, ObjectLayer, ZoneLayer
from hoz_dist.policy.navigator import distance


def test_object_layer_is_equation_6() -> None:
    layer = ObjectLayer(categories=5, features=3)
    detections, appearance = torch.rand(2, 5, 5), torch.rand(2, 5, 4)
    target = torch.eye(5)[[1, 3]]
    with torch.no_grad():
        result = layer(detections, appearance, target)
        for b in range(2):
            x = torch.cat([detections[b], target[b].unsqueeze(1)], dim=1)
            embedding = torch.relu(layer.adjacency @ x @ layer.weight)
            values = torch.cat([appearance[b], detections[b, :, 4:]], dim=1)
            torch.testing.assert_close(result[b], embedding.T @ values)


def test_object_layer_is_zero_when_nothing_is_seen() -> None:
    layer = ObjectLayer(categories=5, features=3)
    assert layer(torch.zeros(1, 5, 5), torch.zeros(1, 5, 4), torch.eye(5)[[2]]).abs().max() == 0.0


def test_zone_update_is_equation_4() -> None:
    layer = ZoneLayer(categories=6, features=2)
    nodes, bag = torch.rand(1, 4, 6), torch.tensor([[1.0, 0, 0, 1, 0, 0]])
    with torch.no_grad():
        moved = layer.update(nodes, bag, torch.eye(4)[[2]])
    expected = update(nodes[0].double().numpy(), bag[0].double().numpy(), 2, layer.update_rate.item())
    np.testing.assert_allclose(moved[0].numpy(), expected, rtol=1e-6)


def test_update_rate_stays_between_zero_and_one() -> None:
    layer = ZoneLayer(categories=6, features=2)
    for extreme in (-30.0, 30.0):
        layer.rate.data.fill_(extreme)
        assert 0.0 < layer.update_rate.item() < 1.0


def test_zone_embedding_is_the_subgoal_row_of_equation_5() -> None:
    layer = ZoneLayer(categories=6, features=3)
    nodes, adjacency = torch.rand(4, 6), torch.rand(4, 4)
    with torch.no_grad():
        whole = torch.relu(adjacency @ nodes @ layer.weight)
        for subgoal in range(4):
            row = layer(nodes.unsqueeze(0), adjacency[subgoal].unsqueeze(0))
            torch.testing.assert_close(row[0], whole[subgoal])


def test_current_zone_agrees_with_the_graph_library() -> None:
    rng = np.random.default_rng(0)
    nodes = rng.random((32, 8, 22))
    bags = (rng.random((32, 22)) < 0.3).astype(float)
    nearest = distance(torch.from_numpy(nodes), torch.from_numpy(bags)).argmin(dim=1)
    assert nearest.tolist() == current_zone(nodes, bags).tolist()


def test_done_reminder_scales_done_alone() -> None:
    reminder = DoneReminder()
    logits = torch.arange(1.0, 7.0).unsqueeze(0)
    target = torch.eye(4)[[2]]
    with torch.no_grad():
        seen = reminder(logits, torch.tensor([[0.0, 0, 0.5, 0]]), target)
        unseen = reminder(logits, torch.tensor([[1.0, 1, 0.0, 1]]), target)
    assert seen[0, : Action.DONE].tolist() == unseen[0, : Action.DONE].tolist() == [1, 2, 3, 4, 5]
    torch.testing.assert_close(seen[0, Action.DONE], torch.tensor(6 * 0.6 * 0.5))
    assert unseen[0, Action.DONE] == 0.0
