"""Lights that move from frame to frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE
from rgspipe.fitting import FitResult, FitStatus, ImageCapture, LightSpec, SearchOptions, prepare_fit
from rgspipe.fitting.parameters import Emitter
from rgspipe.fitting.result import dark_result
from rgspipe.fitting.track import FrameStatus, TrackedFrame, TrackOptions, _Tracker, in_order, predicted, track_lights
from rgspipe.renderer.spot import SpotShape
from rgspipe.scene import LightRig, SpotLight

SHAPE = SpotShape("gaussian", math.radians(30.0), math.radians(12.0))


def _line(start: tuple[float, ...], step: tuple[float, ...], frames: int) -> list[tuple[float, ...]]:
    return [tuple(a + k * b for a, b in zip(start, step, strict=True)) for k in range(frames)]


def test_a_light_is_followed_without_another_search(room, point_light) -> None:
    lights = [point_light(place) for place in _line(VISIBLE, (-0.05, 0.04, -0.03), 5)]
    track = track_lights(room.two, [room.images(light, 2) for light in lights])
    assert [frame.status for frame in track] == [FrameStatus.SEARCHED, *[FrameStatus.TRACKED] * 4]
    pairs = zip(track, lights, strict=True)
    errors = [float((frame.result.lights[0].position - light.position).norm()) for frame, light in pairs]
    assert max(errors) < 1e-4, errors
    assert all(frame.result.evaluations < 0.5 * track[0].result.evaluations for frame in track[1:])


def test_a_light_that_jumps_is_found_again_and_a_dark_frame_does_not_end_the_track(room, point_light) -> None:
    places = [VISIBLE, (0.12, -0.25, 0.3), (-0.3, 0.3, -0.3), None, (-0.3, 0.28, -0.3)]
    frames = [room.images(point_light(p), 2) if p else [torch.zeros(48, 48, 3)] * 2 for p in places]
    track = track_lights(room.two, frames)
    assert [frame.status for frame in track] == [
        FrameStatus.SEARCHED,
        FrameStatus.TRACKED,
        FrameStatus.REDETECTED,
        FrameStatus.LOST,
        FrameStatus.TRACKED,
    ]
    for frame, place in zip(track, places, strict=True):
        if place:
            found = frame.result.lights[0].position
            assert float((found - torch.tensor(place, dtype=torch.float64)).norm()) < 1e-3


def _ambiguous_at_first(monkeypatch, wrong: LightRig, frames: int) -> None:
    """The searches of so many frames end ambiguous, at `wrong`; those after them as they do."""
    searched, calls = _Tracker._searched, []

    def search(tracker: _Tracker, images: Sequence[torch.Tensor], capture: ImageCapture) -> FitResult:
        result = searched(tracker, images, capture)
        calls.append(result)
        return replace(result, lights=wrong, status=FitStatus.AMBIGUOUS) if len(calls) <= frames else result

    monkeypatch.setattr(_Tracker, "_searched", search)


def test_frames_before_the_first_sure_one_are_followed_back_from_it(monkeypatch, room, point_light) -> None:
    """A car that is still around the corner: where it was follows from where it came into sight."""
    places = _line(VISIBLE, (-0.05, 0.04, -0.03), 4)
    frames = [room.images(point_light(place), 2) for place in places]
    _ambiguous_at_first(monkeypatch, (point_light((0.3, 0.3, -0.3)),), 2)
    track = track_lights(room.two, frames, options=TrackOptions())
    assert [frame.status for frame in track] == [
        FrameStatus.TRACED_BACK,
        FrameStatus.TRACED_BACK,
        FrameStatus.REDETECTED,
        FrameStatus.TRACKED,
    ]
    for frame, place in zip(track, places, strict=True):
        found = frame.result.lights[0].position
        assert float((found - torch.tensor(place, dtype=torch.float64)).norm()) < 1e-3
    _ambiguous_at_first(monkeypatch, (point_light((0.3, 0.3, -0.3)),), 2)
    forward = track_lights(room.two, frames[:2], options=TrackOptions(back=False))
    assert not any(frame.sure for frame in forward)
    assert {frame.result.status for frame in forward} == {FitStatus.AMBIGUOUS}


def test_an_answer_with_a_light_that_explains_nothing_is_not_sure(point_light) -> None:
    """Two headlights that one light explains almost as well: the other one of the answer may be anywhere."""
    strong, weak = point_light(VISIBLE), replace(point_light((0.3, 0.3, -0.3)), intensity=0.01 * torch.ones(3).double())
    result = replace(dark_result(0.0), lights=(strong, strong), status=FitStatus.CONVERGED)
    assert TrackedFrame(result, FrameStatus.TRACKED, 0.01).sure
    assert not TrackedFrame(replace(result, lights=(strong, weak)), FrameStatus.TRACKED, 0.01).sure
    assert not TrackedFrame(replace(result, status=FitStatus.AMBIGUOUS), FrameStatus.TRACKED, 0.01).sure


def test_two_spots_that_move_and_turn_keep_their_order(room) -> None:
    """The headlights of a car: one axis, which turns by 4° a frame."""
    spec = LightSpec("spot", 2, SHAPE)
    views = prepare_fit(room.frozen, room.views, dictionary=room.dictionary, spec=spec)
    frames, truth = [], []
    for k in range(4):
        turn = math.radians(4.0 * k)
        axis = torch.tensor([math.cos(turn), math.sin(turn), -0.5], dtype=torch.float64)
        places = torch.tensor([[-0.35 + 0.04 * k, -0.3, 0.1], [-0.35 + 0.04 * k, 0.2, 0.1]], dtype=torch.float64)
        rig = tuple(
            SpotLight(p, (1.0 + j) * torch.ones(3).double(), axis, SHAPE.profile, SHAPE.cone_angle, SHAPE.falloff)
            for j, p in enumerate(places)
        )
        truth.append(rig)
        frames.append([room.frozen.render(view, rig) for view in room.views])
    track = track_lights(views, frames, spec, search=SearchOptions(starts=3))
    assert [frame.status for frame in track[1:]] == [FrameStatus.TRACKED] * 3
    first = [float((light.position - truth[0][0].position).norm()) for light in track[0].result.lights]
    order = [0, 1] if first[0] < first[1] else [1, 0]
    for frame, rig in zip(track, truth, strict=True):
        for k, light in zip(order, frame.result.lights, strict=True):
            assert float((light.position - rig[k].position).norm()) < 2e-3
            assert float((light.direction - torch.nn.functional.normalize(rig[k].direction, dim=0)).norm()) < 5e-3


def test_the_prediction_goes_on_straight_ahead() -> None:
    axis = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    turned = torch.tensor([0.1, 0.0, math.sqrt(0.99)], dtype=torch.float64)
    zero, one = torch.zeros(3, dtype=torch.float64), torch.ones(3, dtype=torch.float64)
    (ahead,) = predicted((Emitter(zero, axis, SHAPE),), (Emitter(one, turned, SHAPE),))
    torch.testing.assert_close(ahead.position, 2.0 * one)
    assert float(ahead.axis.norm()) == pytest.approx(1.0) and float(ahead.axis[0]) == pytest.approx(0.2, abs=2e-3)


def test_lights_keep_the_order_of_the_frame_before(room, point_light) -> None:
    (frame,) = track_lights(room.two, [room.images(point_light(VISIBLE), 2)])
    a, b = point_light((0.0, 0.0, 0.0)), point_light((0.3, 0.0, 0.0))
    matrices = (2.0 * torch.eye(6), torch.eye(6))
    pair = replace(frame.result, lights=(b, a), covariance=matrices, noise_covariance=matrices)
    ordered = in_order(pair, (a, b))
    assert ordered.lights == (a, b) and [float(matrix[0, 0]) for matrix in ordered.covariance] == [1.0, 2.0]
