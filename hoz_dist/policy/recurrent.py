"""An LSTM over whole sequences in which episodes may begin at any step, with a backward pass of its own.

An actor computes every step twice if it acts step by step and then goes over the rollout again to differentiate it.
Here acting records what the LSTM computed on a `Tape`, and the gradient is computed from the tape. Going back, only
what depends on the step after is done step by step; the products with the inputs and the gradients of the weights, most
of the arithmetic, are one product each for the whole sequence.
"""

from collections.abc import Sequence
from typing import Any, Final

import torch
from torch import Tensor, nn

GATES: Final = 4
"""Gates of a cell, in this order: enter, forget, leave (sigmoids), candidate (tanh)."""


class LayerTape:
    """What one layer computed in T steps of B episodes.

    Args:
        steps: T.
        batch: B.
        cells: H.
    """

    def __init__(self, steps: int, batch: int, cells: int) -> None:
        self.gates = torch.empty(steps, batch, GATES * cells)
        """Activations of the gates, [T, B, 4 H]."""
        self.previous_outputs = torch.empty(steps, batch, cells)
        """Outputs of the step before; zero where an episode begins, [T, B, H]."""
        self.previous_cells = torch.empty(steps, batch, cells)
        """Cells of the step before; zero where an episode begins, [T, B, H]."""
        self.squashed = torch.empty(steps, batch, cells)
        """tanh of the cells, [T, B, H]."""
        self.outputs = torch.empty(steps, batch, cells)
        """[T, B, H]."""

    def step(self, t: int, weight: Tensor, output: Tensor, cell: Tensor, keep: Tensor | None) -> tuple[Tensor, Tensor]:
        """Take a step whose gates hold the input's share, and record it.

        Args:
            t: Number of the step.
            weight: Of the recurrent share, [4 H, H].
            output: Outputs of the step before, [B, H].
            cell: Cells of the step before, [B, H].
            keep: 0 where an episode begins and 1 elsewhere, [B, 1]; None where none begins.

        Returns:
            Outputs and cells of this step; the outputs are a view of the tape.
        """
        before, memory = self.previous_outputs[t], self.previous_cells[t]
        if keep is None:
            before.copy_(output)
            memory.copy_(cell)
        else:
            torch.mul(output, keep, out=before)
            torch.mul(cell, keep, out=memory)
        gates = self.gates[t]
        gates.addmm_(before, weight.t())
        width = cell.shape[1]
        gates[:, : 3 * width].sigmoid_()
        gates[:, 3 * width :].tanh_()
        enter, forget, leave, candidate = gates.chunk(GATES, dim=1)
        cell = torch.addcmul(forget * memory, enter, candidate)
        squashed = torch.tanh(cell, out=self.squashed[t])
        return torch.mul(leave, squashed, out=self.outputs[t]), cell


class Tape:
    """What an LSTM computed in up to T steps of B episodes; used again for the next rollout after `rewind`.

    Args:
        steps: T.
        batch: B.
        cells: H.
        layers: Number of layers.

    Attributes:
        layers: What each layer computed.
        resets: Whether an episode begins at any of the steps recorded so far.
        keeps: 0 where an episode begins and 1 elsewhere, [B, 1] for each step recorded so far.
        state: State after the last recorded step, [2, layers, B, H].
    """

    def __init__(self, steps: int, batch: int, cells: int, layers: int) -> None:
        self.layers = [LayerTape(steps, batch, cells) for _ in range(layers)]
        self.resets: list[bool] = []
        self.keeps: list[Tensor] = []
        self.state = torch.zeros(2, layers, batch, cells)

    @property
    def is_empty(self) -> bool:
        """Whether no step is recorded."""
        return not self.resets

    def rewind(self) -> None:
        """Record anew, from the first step on."""
        self.resets.clear()
        self.keeps.clear()

    def advance(self, first: Tensor) -> tuple[int, Tensor | None]:
        """Begin the next step.

        Args:
            first: Whether an episode begins, [B].

        Returns:
            The step's number, and what its state must be multiplied by, [B, 1]; None if no episode begins.
        """
        reset = bool(first.any())
        self.resets.append(reset)
        self.keeps.append((~first).float().unsqueeze(-1))
        return len(self.resets) - 1, self.keeps[-1] if reset else None


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

    def tape(self, steps: int, batch: int) -> Tape:
        """Return an empty tape for T steps of B episodes."""
        return Tape(steps, batch, self.cells, len(self.input_gates))

    @torch.no_grad()
    def step(self, inputs: Tensor, first: Tensor, state: Tensor, tape: Tape) -> Tensor:
        """Take the next step and record it.

        Args:
            inputs: [B, inputs].
            first: Whether an episode begins, [B].
            state: State before the step, [2, layers, B, H].
            tape: Where to record it; not full.

        Returns:
            Outputs of the last layer, [B, H], a view of the tape.
        """
        t, keep = tape.advance(first)
        following = torch.empty_like(state)
        sequence = inputs
        for layer, (linear, weight, record) in enumerate(self._layers(tape)):
            torch.addmm(linear.bias, sequence, linear.weight.t(), out=record.gates[t])
            sequence, cell = record.step(t, weight, state[0, layer], state[1, layer], keep)
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
        keeps = [tape.advance(begins)[1] for begins in first]
        following = torch.empty_like(state)
        sequence = inputs
        for layer, (linear, weight, record) in enumerate(self._layers(tape)):
            shares = record.gates[: len(inputs)].flatten(0, 1)
            torch.addmm(linear.bias, sequence.flatten(0, 1), linear.weight.t(), out=shares)
            output, cell = state[0, layer], state[1, layer]
            for t, keep in enumerate(keeps):
                output, cell = record.step(t, weight, output, cell, keep)
            following[0, layer], following[1, layer] = output, cell
            sequence = record.outputs[: len(inputs)]
        tape.state = following

    def differentiable(self, inputs: Tensor, tape: Tape) -> Tensor:
        """Return the recorded outputs of the last layer so that gradients reach the inputs and the weights.

        Args:
            inputs: Those of the recorded steps, [T, B, inputs].
            tape: What was recorded with the weights as they are now.

        Returns:
            [T, B, H].
        """
        sequence = inputs
        for linear, weight, record in self._layers(tape):
            sequence = _Recorded.apply(sequence, linear.weight, linear.bias, weight, record, tape)  # type: ignore[no-untyped-call]
        return sequence

    def _layers(self, tape: Tape) -> Sequence[tuple[Any, Tensor, LayerTape]]:
        return list(zip(self.input_gates, self.recurrent_gates, tape.layers, strict=True))


class _Recorded(torch.autograd.Function):
    """A layer over a sequence: forward, the outputs on the tape; backward, backpropagation through time.

    The gradients of the gates' inputs are those of the cell or of the output, times factors that are known for all
    steps beforehand.
    """

    @staticmethod
    def forward(
        ctx: Any, inputs: Tensor, input_weight: Tensor, bias: Tensor, weight: Tensor, record: LayerTape, tape: Tape
    ) -> Tensor:
        del bias
        ctx.save_for_backward(inputs, input_weight, weight)
        ctx.record, ctx.keeps, ctx.resets = record, list(tape.keeps), list(tape.resets)
        return record.outputs[: len(inputs)].detach()

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        (of_outputs,) = gradients
        inputs, input_weight, weight = ctx.saved_tensors
        record: LayerTape = ctx.record
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
            if ctx.resets[t]:
                # Nothing goes back beyond the beginning of an episode.
                of_cell.mul_(ctx.keeps[t])
                of_output = torch.addcmul(of_outputs[t - 1], torch.mm(of_gates[t], weight), ctx.keeps[t])
            else:
                of_output = torch.addmm(of_outputs[t - 1], of_gates[t], weight)

        flat = of_gates.flatten(0, 1)
        of_inputs = torch.mm(flat, input_weight).view_as(inputs) if ctx.needs_input_grad[0] else None
        of_input_weight = torch.mm(flat.t(), inputs.flatten(0, 1))
        of_weight = torch.mm(flat.t(), record.previous_outputs[:steps].flatten(0, 1))
        return of_inputs, of_input_weight, flat.sum(0), of_weight, None, None
