"""What an LSTM computed while the agent acted, kept so that going back over the rollout need not compute it again."""

from collections.abc import Sequence
from typing import Final

import torch
from torch import Tensor

from hoz_dist.policy.settings import Precision

GATES: Final = 4
"""Gates of a cell, in this order: enter, forget, leave (sigmoids), candidate (tanh)."""


def dtype_of(precision: Precision) -> torch.dtype:
    """Return the type of the factors of products; fp32 where the processor has no products of bf16."""
    fast = torch.cpu._is_avx512_bf16_supported() or torch.cpu._is_amx_tile_supported()  # noqa: SLF001 - has no other name
    return torch.bfloat16 if precision == "bf16" and fast else torch.float32


class LayerTape:
    """What one layer computed in T steps of B episodes.

    Args:
        steps: T.
        batch: B.
        cells: H.
        dtype: Of the factors of products.

    Attributes:
        gates: Activations of the gates, [T, B, 4 H].
        previous_outputs: Outputs of the step before, zero where an episode begins; factors, [T, B, H].
        previous_cells: Cells of the step before, zero where an episode begins, [T, B, H].
        squashed: tanh of the cells, [T, B, H].
        outputs: [T, B, H].
        input_weight: Factor of the inputs, [4 H, inputs]; the parameter itself, or a copy in another type.
        weight: Factor of the outputs before, [4 H, H]; likewise.
    """

    def __init__(self, steps: int, batch: int, cells: int, dtype: torch.dtype) -> None:
        self.gates = torch.empty(steps, batch, GATES * cells)
        self.previous_outputs = torch.empty(steps, batch, cells, dtype=dtype)
        self.previous_cells = torch.empty(steps, batch, cells)
        self.squashed = torch.empty(steps, batch, cells)
        self.outputs = torch.empty(steps, batch, cells)
        self.input_weight = self.weight = torch.empty(0)

    def hold(self, input_weight: Tensor, weight: Tensor) -> None:
        """Take the weights as they are now."""
        self.input_weight = _as_factor(input_weight, self.input_weight, self.previous_outputs.dtype)
        self.weight = _as_factor(weight, self.weight, self.previous_outputs.dtype)

    def share(self, inputs: Tensor, bias: Tensor, out: Tensor) -> None:
        """Compute the inputs' share of the gates.

        Args:
            inputs: [M, inputs].
            bias: [4 H].
            out: [M, 4 H].
        """
        if self.input_weight.dtype == out.dtype:
            torch.addmm(bias, inputs, self.input_weight.t(), out=out)
        else:
            torch.add(torch.mm(inputs.to(self.input_weight.dtype), self.input_weight.t()), bias, out=out)

    def step(self, t: int, output: Tensor, cell: Tensor, keep: Tensor | None) -> tuple[Tensor, Tensor]:
        """Take a step whose gates hold the inputs' share, and record it.

        Args:
            t: Number of the step.
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
        add_product(gates, before, self.weight.t())
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
        dtype: Of the factors of products.

    Attributes:
        dtype: Of the factors of products.
        layers: What each layer computed.
        resets: Whether an episode begins at any of the steps recorded so far.
        keeps: 0 where an episode begins and 1 elsewhere, [B, 1] for each step recorded so far.
        state: State after the last recorded step, [2, layers, B, H].
    """

    def __init__(self, steps: int, batch: int, cells: int, layers: int, dtype: torch.dtype = torch.float32) -> None:
        self.dtype = dtype
        self.layers: Sequence[LayerTape] = [LayerTape(steps, batch, cells, dtype) for _ in range(layers)]
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


def add_product(total: Tensor, left: Tensor, right: Tensor) -> Tensor:
    """Add the product of two factors of one type, which is rounded to that type, to fp32 totals; return the totals."""
    if left.dtype == total.dtype:
        return total.addmm_(left, right)
    return total.add_(torch.mm(left, right))


def _as_factor(weight: Tensor, factor: Tensor, dtype: torch.dtype) -> Tensor:
    """Return a weight as a factor of products: itself, or a copy in a type, in the memory of the last one."""
    if weight.dtype == dtype:
        return weight.detach()
    if factor.shape != weight.shape:
        factor = torch.empty_like(weight, dtype=dtype, requires_grad=False)
    return factor.copy_(weight.detach())
