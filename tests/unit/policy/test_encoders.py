from pathlib import Path

import numpy as np
import pytest

from hoz_dist.errors import HozError, InvalidValueError
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.policy.encoders.pooled import PooledEncoder


@pytest.mark.parametrize("side", [49, 64, 84])
def test_pooled_cells_average_their_own_pixels(side: int) -> None:
    rng = np.random.default_rng(0)
    rgb = rng.integers(256, size=(2, side, side, 3), dtype=np.uint8)
    depth = rng.uniform(0.5, 5.0, size=(2, side, side)).astype(np.float32)
    grid = PooledEncoder().encode(rgb, depth)
    assert grid.shape == (2, 6, 7, 7)
    edges = [cell * side // 7 for cell in range(8)]
    rows, columns = slice(edges[2], edges[3]), slice(edges[5], edges[6])
    cell, near = rgb[1, rows, columns] / 255, 0.3 / depth[1, rows, columns]
    expected = [*(cell.mean((0, 1)) - 0.5), near.mean(), near.max(), 2 * cell.mean(2).std()]
    np.testing.assert_allclose(grid[1, :, 2, 5], expected, atol=2e-3)


def test_resnet18_without_weights_says_what_it_needs() -> None:
    with pytest.raises(InvalidValueError, match="--weights"):
        load_encoder("resnet18")


def test_resnet18_with_a_file_that_is_none_says_so(tmp_path: Path) -> None:
    weights = tmp_path / "weights.safetensors"
    weights.write_bytes(b"not weights")
    with pytest.raises(HozError, match=r"weights|torchvision"):
        load_encoder("resnet18", weights)


def test_resnet18_makes_512_x_7_x_7(tmp_path: Path) -> None:
    models = pytest.importorskip("torchvision.models", reason="torchvision is an optional extra")
    from safetensors.torch import save_file

    weights = tmp_path / "weights.safetensors"
    save_file(models.resnet18(weights=None).state_dict(), weights)
    encoder = load_encoder("resnet18", weights)
    grid = encoder.encode(np.zeros((2, 84, 84, 3), dtype=np.uint8), np.ones((2, 84, 84), dtype=np.float32))
    assert grid.shape == (2, 512, 7, 7)
    assert grid.dtype == np.float16
