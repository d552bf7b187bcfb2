"""What photographs share tells of exposures, white balance and dark corners that nobody spoke of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from photographed_room import frozen_room, photographs
from rgspipe.capture.exposures import Cameras
from rgspipe.capture.photographs import PixelsOfView
from rgspipe.capture.refusals import check_alike
from rgspipe.capture.unlike import Said
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.training.materials import trace_views

SAID = Said("same", False)


@pytest.fixture(scope="module")
def weights() -> tuple[ViewWeights, ...]:
    return trace_views(frozen_room().surfels, photographs(), 2)


def exposed(spread: float) -> list[View]:
    factors = (
        spread * torch.linspace(-1.0, 1.0, 14)[torch.randperm(14, generator=torch.Generator().manual_seed(1))]
    ).exp()
    return [replace(view, image=view.image * factor) for view, factor in zip(photographs(), factors, strict=True)]


def balanced(spread: float) -> list[View]:
    factors = (spread * torch.randn(14, 3, generator=torch.Generator().manual_seed(1))).exp()
    return [replace(view, image=view.image * factor) for view, factor in zip(photographs(), factors, strict=True)]


def darkened(fallen: float) -> list[View]:
    across = (torch.arange(64) + 0.5 - 32.0) ** 2 / (2.0 * 31.5**2)
    corner = (-fallen * (across[:, None] + across)).exp()[..., None]
    return [replace(view, image=view.image * corner) for view in photographs()]


def shifted() -> list[View]:
    return [replace(view, image=torch.roll(view.image, (1, 1), (0, 1))) for view in photographs()]


@pytest.mark.parametrize(
    ("views", "told"),
    [
        (photographs, SAID),
        (shifted, SAID),
        (lambda: exposed(0.2), Said("free", False)),
        (lambda: balanced(0.1), Said("free_colour", False)),
        (lambda: darkened(0.3), Said("same", True)),
    ],
)
def test_what_was_not_said_is_told(weights, views, told: Said) -> None:
    assert SAID.borne_out(weights, views(), frozen_room().surfels) == told


def test_what_was_said_stays(weights) -> None:
    said = Said("free_colour", True)
    assert said.borne_out(weights, list(photographs()), frozen_room().surfels) == said
    assert SAID.borne_out(weights[:1], list(photographs())[:1], frozen_room().surfels) == SAID


def test_a_photograph_is_evened() -> None:
    cameras = replace(
        Cameras.of(2, "free", True), gains=np.array([[1.0] * 3, [2.0] * 3]), falloff=np.array([-0.3, 0.0])
    )
    view = darkened(0.3)[1]
    evened = cameras.evened(1, PixelsOfView(view))
    np.testing.assert_allclose(2.0 * evened, photographs()[1].image.reshape(-1, 3).numpy(), rtol=1e-5)


def test_exposures_of_their_own_are_refused_beside_lamps_off() -> None:
    check_alike({"": Cameras.of(2, "same", True), "off": Cameras.of(2, "same", False)}, "room")
    with pytest.raises(InputError, match="in lighting off"):
        check_alike({"": Cameras.of(2, "same", False), "off": Cameras.of(2, "free", False)}, "room")
