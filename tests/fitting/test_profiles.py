"""Measured luminaires from images to their answer: place, axis, turn, and which of a catalogue they are."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE
from luminaire_files import COLUMNS, photometry
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.fitting import FitStatus, FitViews, LightSpec, PaperAdam, Search
from rgspipe.fitting.options import AimedOptions
from rgspipe.scene.lights import Photometry, ProfileLight

#: Fewer axes than usual: what is tried is the way.
QUICK = Search(aimed=AimedOptions(axes=30, blocks=64))


def lamp(measured: Photometry) -> ProfileLight:
    axis = torch.nn.functional.normalize(torch.tensor([0.1, 0.2, -1.0], dtype=torch.float64), dim=0)
    return ProfileLight(VISIBLE, [1.0, 2.0, 0.5], axis, 0.6, measured)


def test_place_axis_and_turn_are_found_and_which_luminaire_it_is(room) -> None:
    """Of two: one that is not round, and one that is and nearly its mean."""
    wanted, other = photometry(name="wings.ies"), photometry((COLUMNS[0],), "round.ies")
    shape = replace(ProfileLight.shaped(0.0, other), catalogue=(wanted,))
    spec = LightSpec("profile", shape=shape, shape_free=True)
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=False)
    truth = lamp(wanted)
    result = views.fit(views.render(truth), solver=QUICK)
    (found,) = result.lights
    assert result.status is FitStatus.CONVERGED and found.table == wanted and "profile wings.ies at" in str(result)
    errors = rig_errors(result.lights, (truth,), 1.0)
    assert errors.position < 1e-5 and errors.axis < 1e-3 and errors.intensity < 1e-5
    assert abs(math.remainder(found.turn - truth.turn, 2.0 * math.pi)) < 1e-4
    assert result.covariance[0].shape == (10, 10) and bool(torch.isfinite(result.covariance[0]).all())


def test_the_paper_s_method_turns_none(room) -> None:
    spec = LightSpec("profile", shape=ProfileLight.shaped(0.0, photometry()))
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=False)
    with pytest.raises(ValueError, match="one point"):
        views.fit(views.render(lamp(photometry())), solver=PaperAdam())
