"""Views that do not go with the others are told, and none that do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
import torch

from rgspipe.capture.refusals import OFF
from rgspipe.datasets.views import View
from rgspipe.stages.images.odd_views import tell_astray, tell_odd_views
from scan_layouts import photographed

NAMES = [f"{index}.png" for index in range(12)]


@pytest.fixture(scope="module")
def views() -> list[View]:
    return photographed(12, 24)


def told(views: Sequence[View], capsys: pytest.CaptureFixture[str]) -> str:
    tell_odd_views(views, NAMES)
    return capsys.readouterr().out


def masked(view: View, kept: torch.Tensor) -> View:
    return replace(view, image=view.image * kept[..., None], alpha=view.alpha * kept)


def test_nothing_is_said_of_what_is_right(views: list[View], capsys: pytest.CaptureFixture[str]) -> None:
    tell_astray(views, NAMES)
    assert told(views, capsys) == ""


def test_a_photograph_that_is_black_is_named(views: list[View], capsys: pytest.CaptureFixture[str]) -> None:
    """It counted as one in which the lamps light nothing."""
    black = replace(views[3], image=torch.full_like(views[3].image, 1e-4))
    assert told([*views[:3], black, *views[4:]], capsys).startswith("warning: 3.png: black, ")


def test_photographs_with_the_lamps_off_may_be_black(views: list[View], capsys: pytest.CaptureFixture[str]) -> None:
    black = [replace(view, image=0.0 * view.image, lighting=OFF) for view in views[:3]]
    # Those of other lamps may be far weaker.
    weak = [replace(view, image=1e-5 * view.image, lighting="2") for view in views[3:5]]
    assert told([*black, *weak, *views[5:]], capsys) == ""


@pytest.mark.parametrize("inverted", [True, False])
def test_masks_that_leave_most_out_are_told(
    views: list[View], inverted: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """Masks that hide a quarter of each photograph, and the same the wrong way round, which passed without a word."""
    kept = torch.ones(24, 24)
    kept[:6] = 0.0
    taken = [masked(view, 1.0 - kept if inverted else kept) for view in views]
    assert ("masks or alpha leave out 75 % of the surfaces" in told(taken, capsys)) == inverted
    unknown = [replace(view, depth=torch.where(view.alpha > 0, view.depth, torch.nan)) for view in taken]
    assert ("leave out 75 %" in told(unknown, capsys)) == inverted


def test_where_there_is_nothing_masks_leave_nothing_out(views: list[View], capsys: pytest.CaptureFixture[str]) -> None:
    """As of a thing before nothing, whose alpha is 0 around it."""
    kept = torch.zeros(24, 24)
    kept[8:14, 8:14] = 1.0
    taken = [replace(masked(view, kept), depth=torch.where(kept > 0, view.depth, torch.inf)) for view in views]
    assert told(taken, capsys) == ""


def test_a_view_that_shares_nothing_with_others_is_named(views: list[View], capsys: pytest.CaptureFixture[str]) -> None:
    """Its points contradict nobody: nobody sees them."""
    pose = views[5].camera.camera_to_world.clone()
    pose[:3, 3] *= 10.0
    away = replace(views[5], camera=replace(views[5].camera, camera_to_world=pose))
    tell_astray([*views[:5], away, *views[6:]], NAMES)
    assert capsys.readouterr().out.startswith("warning: 5.png: none of its points is seen by other views")
