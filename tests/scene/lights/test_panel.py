"""One panel has two sets of numbers: results tell one of them, and errors compare whichever is nearer."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.scene.lights import PanelLight, SphereLight

SIDES, TURNS = st.floats(0.0, 2.0), st.floats(-20.0, 20.0)
AXIS = [0.0976, 0.1952, -0.9759]


def panel(width: float, height: float, turn: float) -> PanelLight:
    return PanelLight([0.1, 0.2, 0.3], 1.0, AXIS, width, height, turn)


def corners(light: PanelLight) -> torch.Tensor:
    """(4, 3) in an order that does not depend on how the panel is told: by the angle around its axis."""
    across, up = light.sides()
    signs = torch.tensor([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]).double()
    return light.position + 0.5 * (signs[:, :1] * light.width * across + signs[:, 1:] * light.height * up)


@settings(deadline=None)
@given(SIDES, SIDES, TURNS)
def test_the_told_form_is_the_same_panel(width: float, height: float, turn: float) -> None:
    light = panel(width, height, turn)
    told = light.told
    assert told.width >= told.height and -0.5 * math.pi <= told.turn < 0.5 * math.pi
    assert {told.width, told.height} == {width, height} and told.told == told
    # Each corner of one is a corner of the other.
    assert float(torch.cdist(corners(light), corners(told)).amin(dim=0).max()) < 1e-13


@settings(deadline=None)  # the first one imports scipy
@given(st.floats(0.1, 1.0), st.floats(0.1, 1.0), TURNS)
def test_exchanged_numbers_are_no_error(width: float, height: float, turn: float) -> None:
    light = panel(width, height, turn)
    errors = rig_errors((light.exchanged,), (light,), 1.0)
    assert errors.shape < 1e-12 and Emitter.of(light).distance(Emitter.of(light.exchanged), 1.0) < 1e-12


def test_both_sides_count_as_errors() -> None:
    assert rig_errors((panel(0.3, 0.1, 0.2),), (panel(0.3, 0.15, 0.2),), 1.0).shape == pytest.approx(0.05)
    exchanged = panel(0.1, 0.28, 0.2 - 0.5 * math.pi)
    assert rig_errors((exchanged,), (panel(0.3, 0.1, 0.2),), 1.0).shape == pytest.approx(0.02)


def test_other_lights_are_told_as_they_are() -> None:
    light = SphereLight([0.0, 0.0, 0.0], 1.0, 0.1)
    assert light.told is light and light.like(panel(1.0, 2.0, 0.0)) is light
    assert panel(1.0, 2.0, 0.0).like(light) == panel(1.0, 2.0, 0.0)
    emitter = Emitter.of(panel(2.0, 1.0, 0.0))
    assert emitter.told is emitter
