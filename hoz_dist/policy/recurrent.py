"""An LSTM over whole sequences in which episodes may begin at any step."""

import torch
from torch import Tensor, nn


class EpisodicLSTM(nn.Module):
    """Stacked LSTM whose state is zeroed where an episode begins.

    ``nn.LSTM`` cannot reset its state in mid-sequence. Here the input's share of the gates is computed for the whole
    sequence in one product, and only the recurrent share step by step.

    Args:
        inputs: Number of input features.
        cells: Cells of a layer.
        layers: Number of layers.
    """

    def __init__(self, inputs: int, cells: int, layers: int) -> None:
        super().__init__()
        self.cells = cells
        self.input_gates = nn.ModuleList(nn.Linear(inputs if i == 0 else cells, 4 * cells) for i in range(layers))
        self.recurrent_gates = nn.ParameterList(
            nn.Parameter(nn.init.orthogonal_(torch.empty(4 * cells, cells))) for _ in range(layers)
        )
        with torch.no_grad():
            for layer in self.input_gates:
                bias = layer.get_parameter("bias")
                bias.zero_()
                bias[cells : 2 * cells] = 1.0  # remember by default

    def initial_state(self, batch: int) -> Tensor:
        """Return the zero state, [2, layers, B, cells]: outputs and cells."""
        return torch.zeros(2, len(self.input_gates), batch, self.cells)

    def forward(self, inputs: Tensor, first: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Run over a sequence.

        Args:
            inputs: [T, B, inputs].
            first: Whether an episode begins at the step, [T, B].
            state: State before the first step, [2, layers, B, cells].

        Returns:
            Outputs of the last layer, [T, B, cells], and the state after the last step.
        """
        keep = (~first).to(inputs.dtype).unsqueeze(-1)
        # Most steps start no episode: their state needs no masking.
        resets = first.any(dim=1).tolist()
        outputs, cells = [], []
        sequence = inputs
        for layer, (input_gates, recurrent) in enumerate(zip(self.input_gates, self.recurrent_gates, strict=True)):
            gates_of_input = input_gates(sequence)  # [T, B, 4 cells]
            weight = recurrent.t()
            output, cell = state[0, layer], state[1, layer]
            steps = []
            for t, reset in enumerate(resets):
                if reset:
                    output, cell = output * keep[t], cell * keep[t]
                gates = torch.addmm(gates_of_input[t], output, weight)
                sigmoids = torch.sigmoid(gates[:, : 3 * self.cells])
                enter, forget, leave = sigmoids.chunk(3, dim=1)
                cell = torch.addcmul(forget * cell, enter, torch.tanh(gates[:, 3 * self.cells :]))
                output = leave * torch.tanh(cell)
                steps.append(output)
            sequence = torch.stack(steps)
            outputs.append(output)
            cells.append(cell)
        return sequence, torch.stack([torch.stack(outputs), torch.stack(cells)])
