"""SAVN's steering against what it stands for: gradient steps on the head, written out one episode at a time."""

from itertools import pairwise

import pytest
import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.config import RunConfig
from hoz_dist.policy.fast_weights import steps_before
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.navigator import Guidance
from hoz_dist.policy.parameters import FlatParameters, make_policy
from hoz_dist.policy.settings import PolicySettings
from hoz_dist.policy.steering import Moment
from hoz_dist.policy.steering_savn import LearntAdaptation, LearntLoss
from tests.unit.policy.making import make_observation

SETTINGS = RunConfig(method="savn").policy
H = SETTINGS.sizes.lstm
STEPS, BATCH = 40, 5


def make_moment(first: Tensor) -> Moment:
    """Make outputs, with logits that the head of `make_head` makes of them; the rest is not looked at."""
    outputs = torch.randn(*first.shape, H, generator=torch.Generator().manual_seed(1)).tanh()
    nothing = torch.zeros(*first.shape, 1)
    return Moment(make_head()(outputs).detach(), outputs, nothing, nothing, first)


def make_head() -> nn.Linear:
    torch.manual_seed(2)
    return nn.Linear(H, 6)


def make_steering(settings: PolicySettings = SETTINGS) -> LearntAdaptation:
    """Make one whose steps are large enough to be seen."""
    torch.manual_seed(3)
    steering = LearntAdaptation(settings)
    with torch.no_grad():
        steering.log_step_size.fill_(3.0)
    return steering


def part_of(moment: Moment, rows: slice) -> Moment:
    return Moment._make(part[rows] for part in moment)


def learnt_loss(loss: LearntLoss, outputs: Tensor, policies: Tensor) -> Tensor:
    """Return the loss of one episode's outputs [k, H] and policies [k, 6], as convolutions."""
    sequence = torch.cat([outputs, policies], dim=1).T
    kernels = (layer.weight.view(len(layer.weight), 2, -1).mT for layer in (loss.first, loss.second))
    for kernel, bias, apart in zip(kernels, (loss.first.bias, loss.second.bias), (1, 2), strict=True):
        units = functional.silu(sequence) if apart == 2 else sequence
        sequence = functional.conv1d(functional.pad(units, (apart, 0)), kernel, bias, dilation=apart)
    return torch.linalg.vector_norm(sequence)  # type: ignore[no-any-return]


def step_by_step(steering: LearntAdaptation, moment: Moment, head: nn.Linear, episode: int) -> Tensor:
    """Return the logits of the steps at one place of the batch, [T, 6], by gradient steps on a copy of the head."""
    logits = []
    increment, outputs = torch.zeros(6, H), moment.outputs[:, episode]
    made = 0
    for t in range(len(outputs)):
        if moment.first[t, episode]:
            increment, made = torch.zeros(6, H), 0
        if made in {6, 12, 18, 24}:
            increment.requires_grad_()
            window = outputs[t - 6 : t].unsqueeze(0)
            policies = (head(window) + window @ increment.T).softmax(-1)
            (gradient,) = torch.autograd.grad(learnt_loss(steering.loss, window[0], policies[0]), increment)
            increment = increment.detach() - steering.log_step_size.exp() * gradient
        logits.append(head(outputs[t]) + increment @ outputs[t])
        made += 1
    return torch.stack(logits).detach()


@pytest.mark.parametrize("cuts", [(0, STEPS), (0, 7, 19, STEPS), tuple(range(STEPS + 1))])
def test_the_head_takes_four_gradient_steps_on_the_learnt_loss(cuts: tuple[int, ...]) -> None:
    """Six steps apart, in each episode by itself, wherever rollouts are cut; also one step at a time."""
    first = torch.zeros(STEPS, BATCH, dtype=torch.bool)
    first[0] = True
    first[9, 1] = first[6, 2] = first[12, 2] = first[5, 3] = first[35, 3] = True
    moment, steering, head = make_moment(first), make_steering(), make_head()
    memory, found = steering.initial_memory(BATCH), []
    with torch.no_grad():
        for begin, end in pairwise(cuts):
            steered = steering(part_of(moment, slice(begin, end)), memory, head)
            memory = steered.memory
            found.append(steered.logits)
    expected = torch.stack([step_by_step(steering, moment, head, episode) for episode in range(BATCH)], dim=1)
    torch.testing.assert_close(torch.cat(found), expected, atol=1e-4, rtol=1e-4)
    changed = (expected - moment.logits).abs().amax(dim=2)[:, 0]
    assert changed[:6].max() < 1e-5
    assert changed[6:].min() > 0.01
    assert steering.imitates is False


def test_the_gradient_goes_through_the_adaptation() -> None:
    """Second order: what the loss after it says of the learnt loss, the step size, the head and all below it."""
    policy = make_policy(SETTINGS, 0)
    flat = FlatParameters(policy)
    assert policy.steering is not None
    with torch.no_grad():
        flat.values.mul_(1.5)
        policy.steering.get_parameter("log_step_size").fill_(1.0)
    observation = make_observation(8, 2)
    observation.first[1:] = False
    guidance = Guidance(*(part.expand(8, 2) for part in Guidance.nothing(2)))
    bank = GraphBank(SETTINGS.zones, "product")

    def last() -> Tensor:
        """Of logits that were adapted alone."""
        return policy.unroll(observation, policy.initial_state(2), guidance, bank).logits[-2:].square().sum()

    last().backward()  # type: ignore[no-untyped-call]
    before, gradient = flat.values.clone(), flat.gradients.clone()
    learnt = [parameter for name, parameter in policy.named_parameters() if name.startswith("steering.")]
    for parameters in (list(policy.parameters()), learnt, [policy.actor.weight]):
        kept = torch.zeros_like(gradient)
        for parameter in parameters:
            assert parameter.grad is not None
            offset = (parameter.grad.data_ptr() - flat.gradients.data_ptr()) // 4
            kept[offset : offset + parameter.numel()] = 1.0
        slope = (gradient * kept).norm()
        assert slope > 1e-4
        direction = gradient * kept / slope
        ends = []
        for way in (1.0, -1.0):
            with torch.no_grad():
                flat.values.copy_(before + way * 1e-3 * direction)
                ends.append(last())
        flat.values.copy_(before)
        torch.testing.assert_close((ends[0] - ends[1]) / 2e-3, slope, rtol=2e-2, atol=1e-4)


def test_steps_are_counted_from_the_beginning_of_each_episode() -> None:
    first = torch.tensor([[True, False], [False, False], [False, True], [True, False]])
    assert steps_before(torch.tensor([9, 4]), first).tolist() == [[0, 4], [1, 5], [2, 0], [0, 1]]
