import torch
from torch import Tensor, nn

from hoz_dist.policy.recurrent import EpisodicLSTM
from hoz_dist.policy.tape import Tape

CELLS, INPUTS, LAYERS = 4, 5, 2


def torch_order(gates: Tensor) -> Tensor:
    """Reorder the rows of our gates (input, forget, output, cell) as torch has them (input, forget, cell, output)."""
    enter, forget, leave, cell = gates.chunk(4)
    return torch.cat([enter, forget, cell, leave])


def reference_of(lstm: EpisodicLSTM) -> nn.LSTM:
    reference = nn.LSTM(INPUTS, CELLS, LAYERS)
    with torch.no_grad():
        for layer, (gates, recurrent) in enumerate(zip(lstm.input_gates, lstm.recurrent_gates, strict=True)):
            reference.get_parameter(f"weight_ih_l{layer}").copy_(torch_order(gates.get_parameter("weight")))
            reference.get_parameter(f"bias_ih_l{layer}").copy_(torch_order(gates.get_parameter("bias")))
            reference.get_parameter(f"weight_hh_l{layer}").copy_(torch_order(recurrent))
            reference.get_parameter(f"bias_hh_l{layer}").zero_()
    return reference


def make(seed: int) -> EpisodicLSTM:
    torch.manual_seed(seed)
    return EpisodicLSTM(INPUTS, CELLS, LAYERS)


def run(lstm: EpisodicLSTM, inputs: Tensor, first: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
    tape = lstm.tape(*first.shape)
    lstm.record(inputs, first, state, tape)
    return lstm.differentiable(inputs, tape), tape.state


def by_torch(lstm: EpisodicLSTM, inputs: Tensor, first: Tensor, state: Tensor) -> tuple[Tensor, nn.LSTM]:
    """Go step by step with torch's own LSTM and autograd, and zero the state where an episode begins."""
    reference, (output, cell), outputs = reference_of(lstm), state, []
    for t in range(len(inputs)):
        keep = (~first[t]).float()[None, :, None]
        step, (output, cell) = reference(inputs[t : t + 1], (output * keep, cell * keep))
        outputs.append(step)
    return torch.cat(outputs), reference


def test_without_resets_it_is_torchs_lstm() -> None:
    lstm = make(0)
    inputs, state = torch.randn(6, 3, INPUTS), torch.randn(2, LAYERS, 3, CELLS)
    with torch.no_grad():
        outputs, after = run(lstm, inputs, torch.zeros(6, 3, dtype=torch.bool), state)
        expected, (h, c) = reference_of(lstm)(inputs, (state[0], state[1]))
    torch.testing.assert_close(outputs, expected)
    torch.testing.assert_close(after, torch.stack([h, c]))


def test_a_reset_forgets_everything_before_it() -> None:
    lstm = make(1)
    inputs, first = torch.randn(6, 2, INPUTS), torch.zeros(6, 2, dtype=torch.bool)
    first[3, 1] = True
    state = torch.randn(2, LAYERS, 2, CELLS)
    with torch.no_grad():
        outputs, _ = run(lstm, inputs, first, state)
        untouched, _ = run(lstm, inputs, torch.zeros_like(first), state)
        fresh, _ = run(lstm, inputs[3:, 1:], first[3:, 1:], lstm.initial_state(1))
    torch.testing.assert_close(outputs[3:, 1:], fresh)
    assert not torch.allclose(outputs[3:, 1], untouched[3:, 1])
    torch.testing.assert_close(outputs[:3, 1], untouched[:3, 1])
    torch.testing.assert_close(outputs[:, 0], untouched[:, 0])  # the other episode goes on


def test_acting_step_by_step_records_the_same_sequence_in_any_rollout() -> None:
    lstm, tape = make(2), make(2).tape(5, 3)
    for _ in range(2):  # the tape of one rollout is used again for the next
        inputs, first = torch.randn(5, 3, INPUTS), torch.rand(5, 3) < 0.3
        state = torch.randn(2, LAYERS, 3, CELLS)
        tape.rewind()
        tape.state = state
        seen = [lstm.step(inputs[t], first[t], tape.state, tape).clone() for t in range(5)]
        with torch.no_grad():
            outputs, after = run(lstm, inputs, first, state)
            torch.testing.assert_close(torch.stack(seen), outputs)
            torch.testing.assert_close(lstm.differentiable(inputs, tape), outputs)
        torch.testing.assert_close(tape.state, after)


def test_gradients_are_those_of_torchs_lstm_with_resets() -> None:
    lstm = make(3)
    first = torch.rand(7, 4) < 0.3
    assert first.any()
    inputs, state = torch.randn(7, 4, INPUTS), torch.randn(2, LAYERS, 4, CELLS)
    weights = torch.randn(7, 4, CELLS)
    mine, theirs = inputs.clone().requires_grad_(), inputs.clone().requires_grad_()
    outputs, _ = run(lstm, mine, first, state)
    (outputs * weights).sum().backward()  # type: ignore[no-untyped-call]
    expected, reference = by_torch(lstm, theirs, first, state)
    (expected * weights).sum().backward()  # type: ignore[no-untyped-call]
    torch.testing.assert_close(outputs, expected)
    torch.testing.assert_close(mine.grad, theirs.grad)
    for layer, (gates, recurrent) in enumerate(zip(lstm.input_gates, lstm.recurrent_gates, strict=True)):
        for parameter, name in (
            (gates.get_parameter("weight"), "weight_ih"),
            (gates.get_parameter("bias"), "bias_ih"),
            (recurrent, "weight_hh"),
        ):
            assert parameter.grad is not None
            expected_gradient = reference.get_parameter(f"{name}_l{layer}").grad
            torch.testing.assert_close(torch_order(parameter.grad), expected_gradient)


def test_a_tape_of_lower_precision_takes_the_weights_as_they_are_when_it_is_rewound() -> None:
    lstm = make(4)
    low, full = Tape(5, 3, CELLS, LAYERS, torch.bfloat16), lstm.tape(5, 3)
    inputs, first, state = torch.randn(5, 3, INPUTS), torch.zeros(5, 3, dtype=torch.bool), lstm.initial_state(3)
    for factor in (1.0, -2.0):
        with torch.no_grad():
            for parameter in lstm.parameters():
                parameter.mul_(factor)
        gradients = []
        for tape in (low, full):
            tape.rewind()
            lstm.record(inputs, first, state, tape)
            lstm.zero_grad()
            outputs = lstm.differentiable(inputs, tape)
            outputs.sum().backward()  # type: ignore[no-untyped-call]
            gradients.append(torch.cat([parameter.grad.flatten() for parameter in lstm.parameters()]))  # type: ignore[union-attr]
        assert (gradients[0] - gradients[1]).norm() < 0.03 * gradients[1].norm()
        assert not torch.equal(gradients[0], gradients[1])
        torch.testing.assert_close(low.layers[-1].outputs, full.layers[-1].outputs, atol=0.03, rtol=0.03)
