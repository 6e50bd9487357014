"""TPN's steering: what a deadlock is, and gradient steps on the head, written out one episode at a time."""

from itertools import pairwise

import pytest
import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.config import RunConfig
from hoz_dist.policy.steering import Moment, Steered
from hoz_dist.policy.steering_tpn import REMEMBERED, TentativePolicy

SETTINGS = RunConfig(method="org-tpn").policy
H = SETTINGS.sizes.lstm


def make_steering() -> TentativePolicy:
    """Make one that proposes something, and whose steps are large enough to be seen."""
    torch.manual_seed(3)
    steering = TentativePolicy(SETTINGS)
    with torch.no_grad():
        steering.propose.weight.mul_(30.0)
        steering.log_step_size.fill_(-4.0)
    return steering


def make_moment(views: list[list[int]], first: list[list[bool]]) -> Moment:
    """Make a moment [T, B] of views, given by number [B][T]; the same number is the same picture."""
    numbers, begins = torch.tensor(views).T, torch.tensor(first).T
    generator = torch.Generator().manual_seed(1)
    pictures = torch.randn(int(numbers.max()) + 1, SETTINGS.channels, 7, 7, generator=generator)
    outputs = torch.randn(*numbers.shape, H, generator=generator).tanh()
    logits = torch.randn(*numbers.shape, 6, generator=generator)
    actions = torch.randint(6, numbers.shape, generator=generator).masked_fill(begins, 6)
    return Moment(logits, outputs, pictures[numbers], actions, begins)


def run(steering: TentativePolicy, moment: Moment, cuts: tuple[int, ...]) -> tuple[Tensor, Tensor, Tensor]:
    """Return logits [T, B, 6], those proposed, and where there is a deadlock [T, B], rollout by rollout."""
    memory, parts = steering.initial_memory(moment.first.shape[1]), []
    for begin, end in pairwise(cuts):
        steered: Steered = steering(Moment._make(part[begin:end] for part in moment), memory, nn.Linear(H, 6))
        memory = tuple(part.detach() for part in steered.memory)
        assert steered.imitation is not None
        parts.append((steered.logits, steered.imitation.logits[:, :, 1], steered.imitation.counts))
    logits, proposed, counts = (torch.cat(one) for one in zip(*parts, strict=True))
    return logits, proposed, counts


def begins_at(steps: int, *beginnings: int) -> list[bool]:
    return [t in beginnings for t in range(steps)]


def test_a_deadlock_is_a_view_that_the_episode_has_had() -> None:
    views = [[0, 1, 2, 1, 3, 3, 0], [0, 1, 0, 1, 0, 2, 1]]
    moment = make_moment(views, [begins_at(7, 0), begins_at(7, 0, 4)])
    moment.features[6, 0] += 1e-6 * torch.randn_like(moment.features[6, 0])  # rounding
    moment.features[5, 0] += 0.05 * torch.randn_like(moment.features[5, 0])  # a step ahead, in a large room
    expected = [[False, False, False, True, False, False, True], [False, False, True, True, False, False, False]]
    assert run(make_steering(), moment, (0, 7))[2].T.tolist() == expected


@pytest.mark.parametrize("ago", [REMEMBERED, REMEMBERED + 1])
def test_fifty_steps_are_remembered(ago: int) -> None:
    steps = ago + 1
    moment = make_moment([[*range(steps - 1), 0]], [begins_at(steps, 0)])
    for cuts in ((0, steps), tuple(range(steps + 1))):
        counts = run(make_steering(), moment, cuts)[2].flatten().tolist()
        assert counts == [False] * ago + [ago == REMEMBERED]


@pytest.mark.parametrize("cuts", [(0, 12), (0, 5, 12), tuple(range(13))])
def test_in_deadlocks_the_head_takes_gradient_steps_towards_the_tentative_policy(cuts: tuple[int, ...]) -> None:
    """Before it acts, in each episode by itself, wherever rollouts are cut; also one step at a time."""
    views = [[0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1], [0, 0, 1, 2, 2, 0, 0, 1, 3, 1, 4, 4], list(range(12))]
    moment = make_moment(views, [begins_at(12, 0), begins_at(12, 0, 5, 8), begins_at(12, 0)])
    steering = make_steering()
    with torch.no_grad():
        found, proposed, counts = run(steering, moment, cuts)
    expected = []
    for b in range(3):
        for t in range(12):
            if moment.first[t, b]:
                increment = torch.zeros(6, H)
            outputs = moment.outputs[t, b]
            if counts[t, b]:
                increment.requires_grad_()
                now = moment.logits[t, b] + increment @ outputs
                target = proposed[t, b].softmax(0)
                (gradient,) = torch.autograd.grad(functional.cross_entropy(now, target), increment)
                increment = increment.detach() - steering.log_step_size.exp() * gradient
            expected.append((moment.logits[t, b] + increment @ outputs).detach())
    torch.testing.assert_close(found, torch.stack(expected).view(3, 12, 6).transpose(0, 1), atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(found[:, 2], moment.logits[:, 2])  # never in a deadlock
    assert (found - moment.logits)[2:, 0].abs().amax(dim=1).min() > 0.05


def test_the_tentative_policy_follows_from_what_was_done_in_like_states() -> None:
    """It changes with an action that is remembered, and not with one of the episode before."""
    views = [[0, 1, 2, 3, 4, 2]]
    moment, steering = make_moment(views, [begins_at(6, 0, 2)]), make_steering()
    proposals = []
    for row in (None, 1, 4):
        changed = moment.previous_action.clone()
        if row is not None:
            changed[row] = (changed[row] + 1) % 6
        proposals.append(run(steering, moment._replace(previous_action=changed), (0, 6))[1][-1])
    torch.testing.assert_close(proposals[0], proposals[1])
    assert not torch.allclose(proposals[0], proposals[2])


def test_what_is_taught_is_the_policy_and_the_tentative_policy_and_that_reaches_nothing_else() -> None:
    moment, steering = make_moment([[0, 1, 0]], [begins_at(3, 0)]), make_steering()
    moment.outputs.requires_grad_()
    moment.logits.requires_grad_()
    steered = steering(moment, steering.initial_memory(1), nn.Linear(H, 6))
    assert steered.imitation is not None
    assert torch.equal(steered.imitation.logits[:, :, 0], moment.logits)
    taught = steered.imitation.logits[:, :, 1].square().sum()
    gradients = torch.autograd.grad(taught, [moment.outputs, moment.logits, steering.state.weight], allow_unused=True)
    assert gradients[0] is None
    assert gradients[1].abs().max() == 0
    assert gradients[2].abs().max() > 0
