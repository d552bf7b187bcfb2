"""A camera's own curve is found by photographs of known exposures that differ, and asked for where it cannot be."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from photographed_room import LAMPS, frozen_room, photographs
from rgspipe.capture.radiance import measured_radiance
from rgspipe.capture.refusals import check_brackets
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import srgb
from rgspipe.training.materials import trace_views

#: Exposures, by turns.
EXPOSURES = (0.4, 1.0, 2.5)


@cache
def weights() -> tuple[ViewWeights, ...]:
    return trace_views(frozen_room().surfels, photographs(), 2)


def taken(exposures: tuple[float, ...] = EXPOSURES) -> list[View]:
    """In 8 bits by a camera of gamma 1.5, decoded as sRGB and made alike by their exposures."""
    white = float(torch.stack([view.image for view in photographs()]).quantile(0.98))
    views = []
    for index, view in enumerate(photographs()):
        exposure = exposures[index % len(exposures)]
        level = (exposure * view.image.double().numpy() / white).clip(0.0, 1.0) ** (1.0 / 1.5)
        decoded = srgb.decode(np.round(255.0 * level) / 255.0)
        limit = white / exposure
        image = torch.from_numpy(decoded * limit).float()
        views.append(replace(view, image=image, saturated_from=float(np.float32(limit))))
    return views


def uneven(views: list[View], *, bent: bool) -> float:
    """How much the ratio of what is measured and what is there varies over the surfels."""
    found = measured_radiance(weights(), views, bent=bent)
    with torch.no_grad():
        truth = frozen_room().radiance_of(LAMPS).double().numpy()
    seen = (found.seen > 2.0) & np.isfinite(found.variance)
    off = np.log(found.radiance / truth)[seen].mean(axis=1)
    return float(np.median(np.abs(off - np.median(off))))


def test_light_is_measured_through_a_curve_that_nobody_knows() -> None:
    assert uneven(taken(), bent=True) < 0.02  # 0.0084
    assert uneven(taken(), bent=False) > 0.1  # 0.157


def test_a_curve_that_was_known_stays() -> None:
    views = photographs()
    white = 2.0 * float(torch.stack([view.image for view in views]).max())
    views = [replace(view, saturated_from=white / EXPOSURES[index % 3]) for index, view in enumerate(views)]
    curve = measured_radiance(weights(), views, bent=True).cameras.response
    assert np.abs(curve.logs[2:] - curve.logs[2:].mean()).max() < 0.05, curve.logs  # 0.0078


@pytest.mark.parametrize(
    ("views", "exposure", "said"),
    [
        ([0.5, 0.5], "same", "differ by a factor of 1.00"),
        ([0.5, None], "same", "do not say what white is"),
        ([0.5, 2.0], "free", "only up to a power"),
    ],
)
def test_what_is_missing_is_said(views: list[float | None], exposure: str, said: str) -> None:
    photographs_ = [replace(photographs()[0], saturated_from=white) for white in views]
    with pytest.raises(InputError, match=said):
        check_brackets(photographs_, exposure)
    check_brackets([replace(photographs()[0], saturated_from=white) for white in (0.5, 1.0)], "same")
