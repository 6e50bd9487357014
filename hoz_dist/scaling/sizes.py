"""What travels, bytes: the bulk of messages, from the sizes that the wire has for them.

Maps and checksums, some hundred bytes a message, are left out. P is the number of parameters.
"""

from typing import Final

from hoz_dist.config import RunConfig
from hoz_dist.gradient_forms import blocks_of
from hoz_dist.wire.protocol.parameters import BLOCK, ParametersDelta, ParametersShard, shards_of
from hoz_dist.wire.protocol.trajectories import FRAME_BYTES

TOP_SHARE: Final = 0.01
"""Share of the entries that ``topk`` sends, each with its place. As in the code, which needs PyTorch; a test compares
them."""
COMPRESSIONS: Final = ("fp32", "bf16", "int8", "topk")
PARAMETERS_FORMS: Final = ("full", "delta")


def gradient_bytes(compress: str, parameters: int) -> float:
    """Return the bytes of a gradient of P entries."""
    match compress:
        case "fp32":
            return 4.0 * parameters
        case "bf16":
            return 2.0 * parameters
        case "int8":
            return parameters + 4.0 * blocks_of(parameters)
        case _:
            return TOP_SHARE * parameters * (4.0 + 2.0)


def rollout_bytes(frames: float) -> float:
    """Return the bytes of a rollout; what is observed after the last step is a row more than there are steps."""
    steps = RunConfig().rollout_steps
    return FRAME_BYTES * frames * (steps + 1) / steps


def parameters_bytes(form: str, parameters: int) -> float:
    """Return the bytes of P parameters."""
    return 4.0 * parameters if form == "full" else parameters + 4.0 * -(-parameters // BLOCK)


def questions(form: str, parameters: int) -> int:
    """Return in how many parts P parameters are fetched."""
    return shards_of(parameters, ParametersShard if form == "full" else ParametersDelta)
