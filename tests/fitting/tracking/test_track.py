"""Lights that move from frame to frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews, LightSpec, Search
from rgspipe.fitting.findings import OutOfSteps, Rival
from rgspipe.fitting.options import CertaintyOptions, TrackOptions
from rgspipe.fitting.result import dark_result
from rgspipe.fitting.tracking.frame import FrameStatus, TrackedFrame, in_order
from rgspipe.fitting.tracking.track import search_order, track_lights
from rgspipe.scene import LightRig, SpotLight

SHAPE = SpotLight.shaped("gaussian", math.radians(30.0), math.radians(12.0))


def _error(frame: TrackedFrame, place: Sequence[float] | torch.Tensor) -> float:
    """Distance of the only light from where it is."""
    return float((frame.result.lights[0].position - torch.as_tensor(place, dtype=torch.float64)).norm())


def _line(start: tuple[float, ...], step: tuple[float, ...], frames: int) -> list[tuple[float, ...]]:
    return [tuple(a + k * b for a, b in zip(start, step, strict=True)) for k in range(frames)]


def test_a_light_is_followed_both_ways_from_the_frame_with_most_energy_without_another_search(
    room, point_light
) -> None:
    lights = [point_light(place) for place in _line(VISIBLE, (-0.05, 0.04, -0.03), 5)]
    frames = [room.images(light, 2) for light in lights]
    # The third frame's lamp is brighter: still the same way, but the one to begin with.
    frames[2], lights[2] = [1.5 * image for image in frames[2]], replace(lights[2], intensity=1.5 * lights[2].intensity)
    track = track_lights(room.two, frames)
    assert [frame.status for frame in track] == [
        FrameStatus.TRACED_BACK,
        FrameStatus.TRACED_BACK,
        FrameStatus.SEARCHED,
        FrameStatus.TRACKED,
        FrameStatus.TRACKED,
    ]
    errors = [_error(frame, light.position) for frame, light in zip(track, lights, strict=True)]
    # Measured: 2e-6, and intensities to 1e-5, although that of the third frame is another.
    assert max(errors) < 1e-4, errors
    for frame, light in zip(track, lights, strict=True):
        torch.testing.assert_close(frame.result.lights[0].intensity, light.intensity, rtol=1e-3, atol=0.0)


def test_a_light_that_jumps_is_found_again_and_a_dark_frame_does_not_end_the_track(room, point_light) -> None:
    places = [VISIBLE, (0.12, -0.25, 0.3), (-0.3, 0.3, -0.3), None, (-0.3, 0.28, -0.3)]
    frames = [room.images(point_light(p), 2) if p else [torch.zeros(48, 48, 3)] * 2 for p in places]
    track = track_lights(room.two, frames)
    statuses = [frame.status for frame in track]
    # Whichever side of the jump the track begins on, the other side takes one more search.
    assert sorted(statuses[:3] + statuses[4:]).count(FrameStatus.SEARCHED) == 1
    assert statuses.count(FrameStatus.REDETECTED) == 1 and statuses[3] == FrameStatus.LOST
    for frame, place in zip(track, places, strict=True):
        if place:
            assert _error(frame, place) < 1e-3


def test_frames_are_tensors_arrays_or_lists(room, point_light) -> None:
    images = room.images(point_light(VISIBLE), 2)
    track = track_lights(room.two, [images, [one.numpy() for one in images], [one.tolist() for one in images]])
    assert FrameStatus.LOST not in {frame.status for frame in track}
    # Measured: 9e-8.
    assert max(_error(frame, VISIBLE) for frame in track) < 1e-5


@pytest.mark.parametrize("wrong", [(48, 48, 4), (9, 48, 3)])
def test_frames_of_another_shape_are_refused(room, wrong: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="images"):
        track_lights(room.two, [[torch.ones(wrong)] * 2])


def _sure(frame: TrackedFrame) -> bool:
    return frame.sure(CertaintyOptions().doubtful, TrackOptions().faint)


def test_searches_are_counted(room, point_light) -> None:
    """A jump in a sequence of which only one frame may be searched: one side of it stays lost, and says so.

    No step is longer than 0.12 of the scene, so two of them do not reach over the jump, whichever way they go.
    """
    frames = [room.images(point_light(place), 2) for place in (VISIBLE, (0.4, -0.4, -0.4))]
    track = track_lights(room.two, frames, options=TrackOptions(searches=1), search=Search(iterations=2))
    assert sorted(frame.status for frame in track) == [FrameStatus.LOST, FrameStatus.SEARCHED]
    lost = next(frame for frame in track if frame.status == FrameStatus.LOST)
    assert not _sure(lost) and lost.cost > 0.1


def test_a_sequence_without_light_is_lost(room) -> None:
    (frame,) = track_lights(room.two, [[torch.zeros(48, 48, 3)] * 2])
    assert frame.status == FrameStatus.LOST and not frame.result.lights


def test_a_frame_that_is_searched_in_vain_is_followed_by_one_some_way_off() -> None:
    energies = [1.0, 1.1, 5.0, 5.1, 4.9, 2.0, 2.1, 0.0]
    assert search_order(energies, 1) == [3]
    # Two searches: stretches of two frames.
    assert search_order(energies, 2) == [3, 6]
    assert search_order([0.0, 0.0], 2) == []


def _ambiguous(monkeypatch, wrong: LightRig) -> None:
    """Every search ends ambiguous, at `wrong`."""
    fit = FitViews.fit
    monkeypatch.setattr(FitViews, "fit", lambda *a, **k: replace(fit(*a, **k), lights=wrong, findings=(Rival(0.2),)))


def test_a_track_without_a_sure_frame_is_uncertain_throughout(monkeypatch, room, point_light) -> None:
    places = _line(VISIBLE, (-0.05, 0.04, -0.03), 3)
    frames = [room.images(point_light(place), 2) for place in places]
    _ambiguous(monkeypatch, (point_light((0.1, -0.2, 0.28)),))
    track = track_lights(room.two, frames)
    assert {frame.status for frame in track} == {FrameStatus.UNCERTAIN}
    assert not any(map(_sure, track))


def test_an_answer_with_a_light_that_explains_nothing_is_not_sure(point_light) -> None:
    """Two headlights that one light explains almost as well: the other one of the answer may be anywhere."""
    strong, weak = point_light(VISIBLE), replace(point_light((0.3, 0.3, -0.3)), intensity=0.01 * torch.ones(3).double())
    result = replace(dark_result(0.0), lights=(strong, strong), findings=())
    assert _sure(TrackedFrame(result, FrameStatus.TRACKED, 0.01))
    assert not _sure(TrackedFrame(replace(result, lights=(strong, weak)), FrameStatus.TRACKED, 0.01))
    assert not _sure(TrackedFrame(replace(result, findings=(Rival(0.2),)), FrameStatus.TRACKED, 0.01))
    assert not _sure(TrackedFrame(result, FrameStatus.UNCERTAIN, 0.01))
    # A fit that ran out of steps does not say what its images leave open: the expected errors do.
    steps = replace(result, findings=(OutOfSteps(),))
    assert _sure(TrackedFrame(steps, FrameStatus.SEARCHED, 0.01, (0.01, 0.02)))
    assert not _sure(TrackedFrame(steps, FrameStatus.SEARCHED, 0.01, (0.01, 0.2)))


def test_two_spots_that_move_and_turn_keep_their_order(room) -> None:
    """The headlights of a car: one axis, which turns by 4° a frame."""
    spec = LightSpec("spot", 2, SHAPE)
    views = FitViews.prepare(room.frozen, room.views, lights=spec, sharp=False)
    frames, truth = [], []
    for k in range(4):
        turn = math.radians(4.0 * k)
        axis = torch.tensor([math.cos(turn), math.sin(turn), -0.5], dtype=torch.float64)
        places = torch.tensor([[-0.35 + 0.04 * k, -0.3, 0.1], [-0.35 + 0.04 * k, 0.2, 0.1]], dtype=torch.float64)
        rig = tuple(SHAPE.at(p, axis, (1.0 + j) * torch.ones(3).double()) for j, p in enumerate(places))
        truth.append(rig)
        frames.append([room.frozen.render(view, rig, sharp=False) for view in room.views])
    track = track_lights(views, frames, search=Search(starts=3))
    assert [frame.status for frame in track].count(FrameStatus.SEARCHED) == 1
    assert {frame.status for frame in track} <= {FrameStatus.SEARCHED, FrameStatus.TRACKED, FrameStatus.TRACED_BACK}
    first = [float((light.position - truth[0][0].position).norm()) for light in track[0].result.lights]
    order = [0, 1] if first[0] < first[1] else [1, 0]
    for frame, rig in zip(track, truth, strict=True):
        for k, light in zip(order, frame.result.lights, strict=True):
            assert float((light.position - rig[k].position).norm()) < 2e-3
            assert float((light.direction - torch.nn.functional.normalize(rig[k].direction, dim=0)).norm()) < 5e-3


def test_lights_keep_the_order_of_the_frame_before(room, point_light) -> None:
    (frame,) = track_lights(room.two, [room.images(point_light(VISIBLE), 2)])
    a, b = point_light((0.0, 0.0, 0.0)), point_light((0.3, 0.0, 0.0))
    matrices = (2.0 * torch.eye(6), torch.eye(6))
    pair = replace(frame.result, lights=(b, a), covariance=matrices, noise_covariance=matrices)
    ordered = in_order(pair, (a, b))
    assert ordered.lights == (a, b) and [float(matrix[0, 0]) for matrix in ordered.covariance] == [1.0, 2.0]
