import torch
from torch import Tensor, nn

from hoz_dist.policy.recurrent import EpisodicLSTM

CELLS = 4


def torch_order(gates: Tensor) -> Tensor:
    """Reorder the rows of our gates (input, forget, output, cell) as torch has them (input, forget, cell, output)."""
    enter, forget, leave, cell = gates.chunk(4)
    return torch.cat([enter, forget, cell, leave])


def reference_of(lstm: EpisodicLSTM, inputs: int) -> nn.LSTM:
    reference = nn.LSTM(inputs, CELLS, len(lstm.input_gates))
    with torch.no_grad():
        for layer, (gates, recurrent) in enumerate(zip(lstm.input_gates, lstm.recurrent_gates, strict=True)):
            reference.get_parameter(f"weight_ih_l{layer}").copy_(torch_order(gates.get_parameter("weight")))
            reference.get_parameter(f"bias_ih_l{layer}").copy_(torch_order(gates.get_parameter("bias")))
            reference.get_parameter(f"weight_hh_l{layer}").copy_(torch_order(recurrent))
            reference.get_parameter(f"bias_hh_l{layer}").zero_()
    return reference


def test_without_resets_it_is_torchs_lstm() -> None:
    torch.manual_seed(0)
    lstm = EpisodicLSTM(5, CELLS, 2)
    inputs, state = torch.randn(6, 3, 5), torch.randn(2, 2, 3, CELLS)
    with torch.no_grad():
        outputs, after = lstm(inputs, torch.zeros(6, 3, dtype=torch.bool), state)
        expected, (h, c) = reference_of(lstm, 5)(inputs, (state[0], state[1]))
    torch.testing.assert_close(outputs, expected)
    torch.testing.assert_close(after, torch.stack([h, c]))


def test_a_reset_forgets_everything_before_it() -> None:
    torch.manual_seed(1)
    lstm = EpisodicLSTM(5, CELLS, 2)
    inputs, first = torch.randn(6, 2, 5), torch.zeros(6, 2, dtype=torch.bool)
    first[3, 1] = True
    state = torch.randn(2, 2, 2, CELLS)
    with torch.no_grad():
        outputs, _ = lstm(inputs, first, state)
        untouched, _ = lstm(inputs, torch.zeros_like(first), state)
        fresh, _ = lstm(inputs[3:, 1:], first[3:, 1:], lstm.initial_state(1))
    torch.testing.assert_close(outputs[3:, 1:], fresh)
    assert not torch.allclose(outputs[3:, 1], untouched[3:, 1])
    torch.testing.assert_close(outputs[:3, 1], untouched[:3, 1])
    torch.testing.assert_close(outputs[:, 0], untouched[:, 0])  # the other episode goes on
