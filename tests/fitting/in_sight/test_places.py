"""What the images of lamps tell before anything is fitted: how bright they have to be, and where they may stand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from lit_room import frozen_room, room_cameras
from painted_lamps import with_lamp
from rgspipe.fitting import FitViews
from rgspipe.fitting.in_sight.lamp import BESIDE, LampInSight, given_lamps, grown, left_out, parts
from rgspipe.fitting.in_sight.places import ON_RAY, places
from rgspipe.fitting.in_sight.sight import needed_intensity, pixel_angles
from rgspipe.fitting.in_sight.suspects import sent, shaded
from rgspipe.scene import Camera, PointLight, look_at

PLACE, RADIUS = torch.tensor([0.1, -0.25, 0.2], dtype=torch.float64), 0.04


@pytest.fixture(scope="module")
def views() -> FitViews:
    """The room of `lit_room` by three views of 64²."""
    third = Camera.from_field_of_view(look_at([-0.4, 0.4, 0.35], [0.1, -0.1, -0.1]), 1.4, 64, 64)
    return FitViews.prepare(frozen_room(), [*room_cameras(64), third])


@pytest.fixture(scope="module")
def lamps(views: FitViews) -> list[LampInSight]:
    """The lamp at PLACE as each view sees it."""
    light, found = PointLight(PLACE, 1.0), []
    for index, sight in enumerate(views.sights):
        nothing = torch.zeros(64, 64, 3)
        _, share = with_lamp(nothing, sight.camera, torch.from_numpy(sight.distance), light, RADIUS)
        found.append(LampInSight(index, share.numpy() > 0.5, grown(share.numpy() > 0.5, BESIDE)))
    return found


def test_the_light_that_a_room_needs_is_told_by_its_brightness(views: FitViews) -> None:
    generator = torch.Generator().manual_seed(0)
    for _ in range(8):
        light = PointLight(0.8 * (torch.rand(3, generator=generator).double() - 0.5), 3.0)
        images = views.render(light)
        pairs = zip(views.sights, images, strict=True)
        seen = [shaded(sight, image.double().mean(dim=2).numpy())[sight.surface] for sight, image in pairs]
        needed = needed_intensity(views.prepared, float(np.concatenate(seen).mean()))
        assert 0.5 < needed / 3.0 < 2.5  # measured 0.67 to 1.9: views see a part of the room


def test_what_a_lamp_sends_is_at_most_what_its_pixels_would_send_from_the_wall(
    views: FitViews, lamps: list[LampInSight]
) -> None:
    """I = ∫ y dω d² for a lamp at distance d, and the wall is farther away."""
    for index in (0, 2):  # the edge of the other view's image cuts it
        lamp, sight, light = lamps[index], views.sights[index], PointLight(PLACE, 2.0)
        image, _ = with_lamp(torch.zeros(64, 64, 3), sight.camera, torch.from_numpy(sight.distance), light, RADIUS)
        away, behind = (
            float((PLACE - sight.camera.origin).norm()),
            sight.distance[grown(lamp.pixels, BESIDE) & sight.surface].max(),
        )
        most = sent(sight, image.double().mean(dim=2).numpy(), lamp.pixels)
        # Measured 0.9992 and 0.988: a pixel's corners are no rays of its own.
        assert most == pytest.approx(2.0 * (behind / away) ** 2, rel=0.02)


def test_pixels_fill_the_solid_angle_of_the_image() -> None:
    """Of a pyramid with half angles α: Ω = 4 arcsin(sin² α)."""
    camera = Camera.look_at([0, 0, 0], [1, 0, 0], fov_degrees=70.0, width=200, height=200)
    half = np.radians(35.0)
    assert float(pixel_angles(camera).sum()) == pytest.approx(4.0 * np.arcsin(np.sin(half) ** 2), rel=1e-4)


def test_places_are_on_the_rays_and_where_they_meet(views: FitViews, lamps: list[LampInSight]) -> None:
    found = places(views.sights, lamps, 0.05 * views.prepared.frozen.size).double()
    assert found.shape == (3 * ON_RAY + 3, 3)
    away = (found[-3:] - PLACE).norm(dim=1)
    assert float(away.max()) < 0.05  # where two rays meet; measured 0.005 to 0.031
    for index, sight in enumerate(views.sights):
        ray = found[index * ON_RAY : (index + 1) * ON_RAY] - sight.camera.origin
        to_lamp = torch.nn.functional.normalize(PLACE - sight.camera.origin, dim=0)
        beside = (ray - (ray @ to_lamp)[:, None] * to_lamp).norm(dim=1)
        assert float((beside / ray.norm(dim=1)).max()) < 0.035  # rad; a pixel is 0.026, measured 0.028
    assert len(places(views.sights, lamps[:1], 0.05)) == ON_RAY and places(views.sights, [], 0.05).shape == (0, 3)


def test_places_are_candidates_besides_those_of_the_scene(views: FitViews, lamps: list[LampInSight]) -> None:
    own, more = views.dictionary, places(views.sights, lamps, 0.05)
    masks = left_out(lamps, [(64, 64)] * 3)
    fewer = views.without(masks, more)
    joined = fewer.dictionary
    assert torch.equal(joined.positions, torch.cat([own.positions, more]))
    assert torch.equal(joined.irradiance[: len(own)], own.irradiance)
    irradiance, _ = views.prepared.frozen.unit_irradiance(more)
    torch.testing.assert_close(joined.irradiance[len(own) :], irradiance, rtol=1e-6, atol=0.0)
    out = torch.from_numpy(np.concatenate([mask.reshape(-1) for mask in masks]))
    assert not out[fewer.prepared.pixels].any() and len(fewer.prepared.pixels) < len(views.prepared.pixels)
    kept = ~out[views.prepared.pixels]
    assert torch.equal(fewer.prepared.pixels, views.prepared.pixels[kept])
    assert abs(fewer.prepared.operator.to_scipy() - views.prepared.operator.to_scipy()[kept.numpy()]).nnz == 0
    assert all(
        not bool(mask[torch.from_numpy(one)].any()) for mask, one in zip(fewer.prepared.masks, masks, strict=True)
    )


def test_masks_fall_into_parts_that_touch() -> None:
    mask = np.zeros((6, 8), dtype=bool)
    mask[0, 0] = mask[1, 1] = mask[4, 6] = True
    assert sorted(int(part.sum()) for part in parts(mask)) == [1, 2]
    first, second = given_lamps([mask])
    assert first.place == (1.0, 1.0) and second.place == (6.5, 4.5) and second.given
    assert np.array_equal(left_out([first, second], [(6, 8)])[0], mask)
    assert [int(grown(part, 1).sum()) for part in (first.core, second.core)] == [9, 9]
