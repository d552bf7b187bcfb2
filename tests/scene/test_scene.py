"""Cameras and surfels as plain data."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from rgspipe.errors import InputError
from rgspipe.scene import Camera, Gloss, Surfels, look_at
from rgspipe.scene.surfels import quaternion_from_normal, quaternion_to_axes
from rooms import closed_box

coordinate = st.floats(-2.0, 2.0)


def camera(resolution: int = 8) -> Camera:
    pose = look_at(torch.tensor([0.3, -2.0, 0.4]), torch.tensor([0.0, 0.1, 0.0]))
    return Camera.from_field_of_view(pose, 0.8, resolution, resolution)


@given(st.integers(0, 63), st.floats(0.1, 10.0))
def test_a_point_on_a_pixel_s_ray_projects_into_its_centre(pixel: int, depth: float) -> None:
    view = camera()
    origins, directions, lengths = view.rays(torch.tensor([pixel]))
    place, found = view.project(origins + directions * (depth * lengths[:, None]))
    # Measured 9e-16.
    torch.testing.assert_close(place[0], torch.tensor([pixel % 8 + 0.5, pixel // 8 + 0.5]).double(), atol=1e-9, rtol=0)
    assert float(found) == pytest.approx(depth, rel=1e-12)


def test_subsamples_average_to_the_centre() -> None:
    view = camera()
    _, fine, lengths = view.rays(torch.tensor([10]), subsamples=4)
    _, centre, one = view.rays(torch.tensor([10]))
    planar = (fine * lengths[:, None]).mean(dim=0)
    torch.testing.assert_close(planar, centre[0] * one[0], atol=1e-12, rtol=0)


def test_a_reduced_camera_sees_the_same() -> None:
    large = replace(camera(), width=96, height=64, fx=80.0, fy=82.0, cx=47.0, cy=30.0)
    small = large.reduced(48)
    assert (small.width, small.height) == (48, 32)
    assert (small.fx, small.fy, small.cx, small.cy) == (40.0, 41.0, 23.5, 15.0)
    thin = replace(large, height=1).reduced(48)
    assert (thin.width, thin.height) == (48, 1)


def test_a_resized_camera_keeps_its_field_of_view() -> None:
    small = replace(camera(), width=32, height=21)
    large = small.resized(80)
    point = torch.tensor([[0.1, 0.2, 0.3]], dtype=torch.float64)
    (x, y), (u, v) = small.project(point)[0][0].tolist(), large.project(point)[0][0].tolist()
    assert (large.width, large.height) == (80, 52)  # 52.5, rounded to even
    assert (u / x, v / y) == pytest.approx((80 / 32, 52 / 21), rel=1e-12)
    assert small.resized(64, 64).height == 64


def test_a_camera_is_never_enlarged_by_reducing_it() -> None:
    view = camera()
    assert view.reduced(view.width) == view.reduced(1000) == view


@given(coordinate, coordinate, coordinate)
def test_looking_anywhere_gives_a_rotation(x: float, y: float, z: float) -> None:
    origin = torch.tensor([5.0, 5.0, 5.0])
    matrix = look_at(origin, torch.tensor([x, y, z]))
    torch.testing.assert_close(matrix[:3, :3] @ matrix[:3, :3].T, torch.eye(3).double(), atol=1e-9, rtol=0)
    assert float(torch.linalg.det(matrix[:3, :3])) == pytest.approx(1.0, abs=1e-9)


def test_looking_straight_up_and_down_works() -> None:
    for target in (torch.tensor([0.0, 0.0, 1.0]), torch.tensor([0.0, 0.0, -1.0])):
        assert torch.isfinite(look_at(torch.zeros(3), target)).all()


@given(coordinate, coordinate, coordinate)
def test_a_rotation_from_a_normal_has_that_normal(x: float, y: float, z: float) -> None:
    normal = torch.nn.functional.normalize(torch.tensor([[x, y, z - 1e-3]], dtype=torch.float64), dim=1)
    frame = quaternion_to_axes(quaternion_from_normal(normal))[0]
    # Measured 3e-14, next to −z.
    torch.testing.assert_close(frame[2], normal[0], atol=1e-9, rtol=0)
    torch.testing.assert_close(frame @ frame.T, torch.eye(3).double(), atol=1e-9, rtol=0)


def test_surfels_of_a_wrong_shape_are_refused() -> None:
    tensors = closed_box(0.5).tensors()
    coverage = closed_box(0.5).coverage
    with pytest.raises(InputError, match=r"surfels.scales: expected numbers of shape \(24, 2\), found shape \(24, 3\)"):
        Surfels(**(tensors | {"scales": torch.ones(24, 3)}), coverage=coverage)


def test_gloss_moves_with_its_surfels_and_must_fit_them() -> None:
    surfels = closed_box(0.5)
    gloss = Gloss(torch.full((24, 3), 0.2), torch.full((24,), 10.0))
    moved = replace(surfels, gloss=gloss).to(torch.float64)
    assert moved.gloss.reflectance.dtype == moved.gloss.exponents.dtype == torch.float64
    assert surfels.to(torch.float32).gloss is None
    with pytest.raises(ValueError, match=r"surfels.gloss must be of 24 surfels, got 3"):
        replace(surfels, gloss=Gloss(torch.zeros(3, 3), torch.ones(3)))
    with pytest.raises(ValueError, match=r"gloss.exponents must have shape \(3,\), got \(4,\)"):
        Gloss(torch.zeros(3, 3), torch.ones(4))


@pytest.mark.parametrize(
    ("reflectance", "exponent", "message"),
    [(0.6, 2.0, "at most 1, got 1.1"), (-0.1, 2.0, "must not be negative"), (0.3, 0.5, "at least 1, got 0.5")],
)
def test_gloss_that_makes_energy_or_has_no_slope_is_refused(reflectance, exponent, message) -> None:
    gloss = Gloss(torch.full((2, 3), reflectance), torch.full((2,), exponent))
    with pytest.raises(ValueError, match=message):
        gloss.check(torch.full((2, 3), 0.5))
