"""An LSTM over whole sequences in which episodes may begin at any step, with a backward pass of its own.

An actor computes every step twice if it acts step by step and then goes over the rollout again to differentiate it.
Here acting records what the LSTM computed on a `Tape`, and the gradient is computed from the tape. Going back, only
what depends on the step after is done step by step; the products with the inputs and the gradients of the weights, most
of the arithmetic, are one product each for the whole sequence.
"""

from typing import Any

import torch
from torch import Tensor, nn

from hoz_dist.policy.settings import Precision
from hoz_dist.policy.tape import GATES, LayerTape, Tape, dtype_of


class EpisodicLSTM(nn.Module):
    """Stacked LSTM whose state is zeroed where an episode begins, which ``nn.LSTM`` cannot do in mid-sequence.

    Args:
        inputs: Number of input features.
        cells: H, cells of a layer.
        layers: Number of layers.
    """

    def __init__(self, inputs: int, cells: int, layers: int) -> None:
        super().__init__()
        self.cells = cells
        self.input_gates = nn.ModuleList(nn.Linear(inputs if i == 0 else cells, GATES * cells) for i in range(layers))
        self.recurrent_gates = nn.ParameterList(
            nn.Parameter(nn.init.orthogonal_(torch.empty(GATES * cells, cells))) for _ in range(layers)
        )
        with torch.no_grad():
            for layer in self.input_gates:
                bias = layer.get_parameter("bias")
                bias.zero_()
                bias[cells : 2 * cells] = 1.0  # remember by default

    def initial_state(self, batch: int) -> Tensor:
        """Return the zero state, [2, layers, B, H]: outputs and cells."""
        return torch.zeros(2, len(self.input_gates), batch, self.cells)

    def tape(self, steps: int, batch: int, precision: Precision = "fp32") -> Tape:
        """Return an empty tape for T steps of B episodes, whose products have factors of some precision."""
        return Tape(steps, batch, self.cells, len(self.input_gates), dtype_of(precision))

    @torch.no_grad()
    def step(self, inputs: Tensor, first: Tensor, state: Tensor, tape: Tape) -> Tensor:
        """Take the next step and record it.

        Args:
            inputs: [B, inputs], fp32 or of the tape's type.
            first: Whether an episode begins, [B].
            state: State before the step, [2, layers, B, H].
            tape: Where to record it; not full.

        Returns:
            Outputs of the last layer, [B, H], a view of the tape.
        """
        if tape.is_empty:
            self._hold_weights(tape)
        t, keep = tape.advance(first)
        following = torch.empty_like(state)
        sequence = inputs
        for layer, record in enumerate(tape.layers):
            record.share(sequence, self._bias(layer), out=record.gates[t])
            sequence, cell = record.step(t, state[0, layer], state[1, layer], keep)
            following[0, layer], following[1, layer] = sequence, cell
        tape.state = following
        return sequence

    @torch.no_grad()
    def record(self, inputs: Tensor, first: Tensor, state: Tensor, tape: Tape) -> None:
        """Run over a whole sequence and record it.

        Args:
            inputs: [T, B, inputs].
            first: Whether an episode begins at the step, [T, B].
            state: State before the first step, [2, layers, B, H].
            tape: Where to record it, empty.
        """
        self._hold_weights(tape)
        keeps = [tape.advance(begins)[1] for begins in first]
        following = torch.empty_like(state)
        sequence = inputs
        for layer, record in enumerate(tape.layers):
            shares = record.gates[: len(inputs)].flatten(0, 1)
            record.share(sequence.flatten(0, 1), self._bias(layer), out=shares)
            output, cell = state[0, layer], state[1, layer]
            for t, keep in enumerate(keeps):
                output, cell = record.step(t, output, cell, keep)
            following[0, layer], following[1, layer] = output, cell
            sequence = record.outputs[: len(inputs)]
        tape.state = following

    def differentiable(self, inputs: Tensor, tape: Tape) -> Tensor:
        """Return the recorded outputs of the last layer so that gradients reach the inputs and the weights.

        Args:
            inputs: Those of the recorded steps, [T, B, inputs].
            tape: What was recorded with the weights as they are now. It must stay as it is until the gradient is
                computed.

        Returns:
            [T, B, H].
        """
        sequence = inputs
        for layer, record in enumerate(tape.layers):
            weights = self._input_weight(layer), self._bias(layer), self.recurrent_gates[layer]
            sequence = _Recorded.apply(sequence, *weights, record, tape)  # type: ignore[no-untyped-call]
        return sequence

    def _hold_weights(self, tape: Tape) -> None:
        for layer, record in enumerate(tape.layers):
            record.hold(self._input_weight(layer), self.recurrent_gates[layer])

    def _input_weight(self, layer: int) -> Tensor:
        return self.input_gates[layer].get_parameter("weight")

    def _bias(self, layer: int) -> Tensor:
        return self.input_gates[layer].get_parameter("bias")


class _Recorded(torch.autograd.Function):
    """A layer over a sequence: forward, the outputs on the tape; backward, backpropagation through time.

    The gradients of the gates' inputs are those of the cell or of the output, times factors that are known for all
    steps beforehand.
    """

    @staticmethod
    def forward(
        ctx: Any, inputs: Tensor, input_weight: Tensor, bias: Tensor, weight: Tensor, record: LayerTape, tape: Tape
    ) -> Tensor:
        del input_weight, bias, weight  # they get gradients; as factors they are on the tape
        ctx.save_for_backward(inputs)
        ctx.record, ctx.keeps, ctx.resets = record, list(tape.keeps), list(tape.resets)
        return record.outputs[: len(inputs)].detach()

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        (of_outputs,) = gradients
        (inputs,) = ctx.saved_tensors
        record: LayerTape = ctx.record
        factor = record.weight.dtype
        steps, batch, width = of_outputs.shape
        enter, forget, leave, candidate = record.gates[:steps].chunk(GATES, dim=2)
        squashed, memory = record.squashed[:steps], record.previous_cells[:steps]

        # What the gradients of cells and outputs are multiplied by, for all steps at once.
        of_gates = torch.empty(steps, batch, GATES * width)
        of_enter, of_forget, of_leave, of_candidate = of_gates.chunk(GATES, dim=2)
        torch.addcmul(enter, enter * candidate, candidate, value=-1.0, out=of_candidate)  # i (1 - g^2)
        torch.mul(candidate, torch.addcmul(enter, enter, enter, value=-1.0), out=of_enter)  # g i (1 - i)
        torch.mul(memory, torch.addcmul(forget, forget, forget, value=-1.0), out=of_forget)  # c f (1 - f)
        torch.mul(squashed, torch.addcmul(leave, leave, leave, value=-1.0), out=of_leave)  # tanh(c) o (1 - o)
        through = torch.addcmul(leave, leave * squashed, squashed, value=-1.0)  # o (1 - tanh^2 c)

        of_output = of_outputs[-1]
        of_cell = torch.zeros(batch, width)
        for t in range(steps - 1, -1, -1):
            of_cell = torch.addcmul(of_cell, of_output, through[t])
            of_enter[t].mul_(of_cell)
            of_forget[t].mul_(of_cell)
            of_candidate[t].mul_(of_cell)
            of_leave[t].mul_(of_output)
            if t == 0:
                break
            of_cell = of_cell * forget[t]
            of_output = torch.mm(of_gates[t].to(factor), record.weight)
            if ctx.resets[t]:
                # Nothing goes back beyond the beginning of an episode.
                of_cell.mul_(ctx.keeps[t])
                of_output = of_output * ctx.keeps[t]
            of_output = of_outputs[t - 1] + of_output

        flat = of_gates.flatten(0, 1)
        of_bias, flat = flat.sum(0), flat.to(factor)
        of_inputs = (
            torch.mm(flat, record.input_weight).view_as(inputs).to(inputs.dtype) if ctx.needs_input_grad[0] else None
        )
        of_input_weight = torch.mm(flat.t(), inputs.flatten(0, 1).to(factor)).float()
        of_weight = torch.mm(flat.t(), record.previous_outputs[:steps].flatten(0, 1)).float()
        return of_inputs, of_input_weight, of_bias, of_weight, None, None
