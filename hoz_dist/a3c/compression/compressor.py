"""What an actor does with a gradient before it is sent: error feedback."""

import torch

from hoz_dist.a3c.compression.borrowing import borrowed
from hoz_dist.a3c.compression.codecs import Bf16, Codec, Int8, TopK
from hoz_dist.config import Compression
from hoz_dist.gradient_forms import Gradient, Vector


class Compressor:
    """Brings gradients into the form of a codec; one for an actor.

    What a codec leaves of a gradient, the error, is added to the next one [Seide et al. 2014, Karimireddy et al. 2019]:
    all that is sent adds up to all gradients, less the error of the last one. The error counts from `accepted` on. A
    gradient that is refused, because it is too old, is lost as it is without a codec: neither it nor what was to be
    sent of it counts, and the error stays that of the last one that was accepted.

    Args:
        compression: The codec.
        size: P, number of entries.
        largest: Largest norm of what is sent.
    """

    def __init__(self, compression: Compression, size: int, largest: float) -> None:
        self._largest = largest
        self._codec = _codec(compression, size)
        rest = size if self._codec is not None else 0
        self._error = torch.zeros(rest)
        """What is left of the gradients that were accepted."""
        self._new_error = torch.zeros(rest)
        """What will be left once the last one is accepted."""

    def compress(self, gradient: Vector, version: int) -> Gradient:
        """Return what is to be sent.

        Args:
            gradient: [P], finite, its norm within the bound; left as it is.
            version: Version of the parameters that it was computed on: `TopK` sends more of the first ones.

        Returns:
            Valid until the next call; the gradient itself if it travels in full.
        """
        if self._codec is None:
            return gradient
        torch.add(self._error, borrowed(gradient), out=self._new_error)
        return self._codec.take(self._new_error, self._largest, version)

    def accepted(self) -> None:
        """Say that the learner has accepted what was returned last."""
        self._error, self._new_error = self._new_error, self._error


def _codec(compression: Compression, size: int) -> Codec | None:
    match compression:
        case "fp32":
            return None
        case "bf16":
            return Bf16(size)
        case "int8":
            return Int8(size)
        case "topk":
            return TopK(size)
