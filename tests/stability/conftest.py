"""Errors against float64, bounded and recorded."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from double_precision import DoubleTransport
from hard_cases import room
from rgspipe.renderer.frozen import FrozenScene

Within = Callable[..., None]


@pytest.fixture(scope="module")
def frozen() -> FrozenScene:
    """The small room of the hard cases."""
    return FrozenScene.freeze(room(), gather_rays=16, patches=20, seed=0)


@pytest.fixture(scope="module")
def double(frozen: FrozenScene) -> DoubleTransport:
    """Its transport in float64."""
    return DoubleTransport.of(frozen)


@pytest.fixture
def within(record_property: Callable[[str, object], None]) -> Within:
    """A check that values are finite and near those of float64; `--junitxml=FILE` writes the measured errors."""

    def check(
        what: str,
        found: Tensor,
        expected: Tensor,
        bound: float,
        *,
        least: float = 0.0,
        outliers: float = 0.0,
        cap: float | None = None,
    ) -> None:
        """Compare in units of the largest expected value.

        Args:
            least: the unit, where all expected values are smaller: what is next to this does not matter.
            bound: on the error of all values but the share `outliers`.
            cap: on the error of those, which lie on either side of a jump: a footprint's rim, a layer's end.
        """
        assert torch.isfinite(found).all(), f"{what} holds NaN or infinity"
        assert torch.isfinite(expected).all(), f"{what}: the reference holds NaN or infinity"
        assert found.shape == expected.shape, f"{what}: shape {tuple(found.shape)}, not {tuple(expected.shape)}"
        if found.numel() == 0:
            return
        error = (found.detach().double() - expected.detach().double()).abs().reshape(-1)
        unit = max(float(expected.detach().abs().max()), least) or 1.0
        typical = float(error.sort().values[int((1.0 - outliers) * (len(error) - 1))]) / unit
        largest = float(error.max()) / unit
        record_property(what, f"{typical:.1e} {largest:.1e} of {unit:.1e}")
        assert typical <= bound, f"{what}: error {typical:.1e} of the largest value, above {bound:.0e}"
        limit = bound if cap is None else cap
        assert largest <= limit, f"{what}: largest error {largest:.1e} of the largest value, above {limit:.0e}"

    return check
