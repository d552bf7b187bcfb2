"""Each error of a capture has the size that it says, comes from the seed, and leaves the rest alone."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from raycast import room_views
from rgspipe.datasets.views import View
from rgspipe.degradation.degraded_views import degraded
from rgspipe.degradation.options import ViewErrors
from rgspipe.scene import PointLight


@pytest.fixture(scope="module")
def views() -> list[View]:
    light = PointLight(torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64), torch.full((3,), 2.0, dtype=torch.float64))
    return [
        replace(view, light=light, image=torch.full_like(view.image, 0.5), albedo=torch.full_like(view.image, 0.7))
        for view in room_views(8, 64, normals=True)
    ]


def test_the_default_changes_nothing(views: list[View]) -> None:
    """Not even copies are made: the fields are the very same tensors."""
    kept = degraded(views, ViewErrors())
    assert len(kept) == len(views)
    for view, one in zip(views, kept, strict=True):
        assert all(getattr(one, name) is value for name, value in vars(view).items() if name != "light")
        assert one.light == view.light


def test_depth_noise_is_relative_and_independent_in_every_pixel(views: list[View]) -> None:
    noisy = degraded(views, ViewErrors(depth_noise=0.02))
    noise = torch.stack([got.depth / view.depth - 1 for got, view in zip(noisy, views, strict=True)])
    assert float(noise.std()) == pytest.approx(0.02, rel=0.02)  # measured 0.9992
    assert abs(float(noise.mean())) < 4e-4  # 4 σ/√n = 4.4e-4, measured 5e-6
    neighbours = (noise[:, :, 1:] * noise[:, :, :-1]).mean() / noise.square().mean()
    assert abs(float(neighbours)) < 0.02  # measured 0.0035


@pytest.mark.parametrize("share", [0.0001, 0.05, 0.2, 0.7])
def test_missing_depth_has_exactly_its_share(views: list[View], share: float) -> None:
    for view in degraded(views, ViewErrors(depth_missing=share)):
        assert int(view.depth.isnan().sum()) == round(share * view.depth.numel())


def test_half_of_the_missing_depth_is_in_blobs(views: list[View]) -> None:
    holes = torch.stack([view.depth for view in degraded(views, ViewErrors(depth_missing=0.2))]).isnan()
    # All four neighbours of a pixel in a blob are missing too; of independent pixels only 0.2⁴.
    around = holes[:, :-2, 1:-1] & holes[:, 2:, 1:-1] & holes[:, 1:-1, :-2] & holes[:, 1:-1, 2:]
    share = float((holes[:, 1:-1, 1:-1] & around).sum() / holes[:, 1:-1, 1:-1].sum())
    assert 0.15 < share < 0.5  # measured 0.235


def test_image_noise_grows_with_the_value_and_stays_off_the_background(views: list[View]) -> None:
    alpha = torch.ones_like(views[0].alpha)
    alpha[:, :8] = 0.0
    image = torch.full_like(views[0].image, 0.5) * alpha[..., None]
    image[32:] *= 0.01
    (noisy,) = degraded([replace(views[0], image=image, alpha=alpha)], ViewErrors(image_noise=0.02))
    off = noisy.image - image
    assert float(off[:32, 8:].std()) == pytest.approx(0.02 * 0.5 * 1.005, rel=0.03)  # measured 0.994
    assert float(off[32:, 8:].std()) == pytest.approx(0.02 * 0.05 * 1.005, rel=0.03)  # read noise; measured 1.001
    assert not off[:, :8].any()


def test_lights_are_off_by_what_was_asked(views: list[View]) -> None:
    many = [views[0]] * 400
    lights = [v.light for v in degraded(many, ViewErrors(light_position_noise=0.01, light_intensity_noise=0.05))]
    shifts = torch.stack([light.position for light in lights]) - views[0].light.position
    gains = torch.stack([light.intensity for light in lights]).log() - views[0].light.intensity.log()
    assert float(shifts.std()) == pytest.approx(0.01, rel=0.1)  # measured 1.009
    assert float(gains[:, 0].std()) == pytest.approx(0.05, rel=0.15)  # measured 0.994
    assert torch.allclose(gains[:, :1].expand(-1, 3), gains)


@settings(max_examples=20, deadline=None)
@given(count=st.integers(1, 12))
def test_kept_views_are_spread_and_keep_their_errors(views: list[View], count: int) -> None:
    everything = {v.name: v for v in degraded(views, ViewErrors(depth_noise=0.01, seed=3))}
    kept = degraded(views, ViewErrors(depth_noise=0.01, seed=3, views=count))
    names = [v.name for v in kept]
    assert len(names) == len(set(names)) == min(count, len(views))
    assert names == sorted(names)
    assert all(torch.equal(v.depth, everything[v.name].depth) for v in kept)


def test_one_error_more_leaves_the_others_as_they_were(views: list[View]) -> None:
    alone = degraded(views[:1], ViewErrors(depth_noise=0.01))[0]
    both = degraded(views[:1], ViewErrors(depth_noise=0.01, depth_missing=0.2, image_noise=0.1))[0]
    seen = ~both.depth.isnan()
    assert torch.equal(alone.depth[seen], both.depth[seen])
    other = degraded(views[:1], ViewErrors(depth_noise=0.01, seed=1))[0]
    assert not torch.equal(alone.depth, other.depth)


def test_passes_can_be_dropped(views: list[View]) -> None:
    (view,) = degraded(views[:1], ViewErrors(normals=False, albedo=False))
    assert view.normal is None and view.albedo is None
    assert view.depth is views[0].depth


def test_exposures_have_their_spread_and_no_common_factor(views: list[View]) -> None:
    taken = degraded([views[0]] * 400, ViewErrors(exposure=0.5))
    stops = torch.stack([one.image.mean() / views[0].image.mean() for one in taken]).log2()
    assert float(stops.std()) == pytest.approx(0.5, rel=0.1)  # measured 0.99
    assert abs(float(stops.mean())) < 1e-6


def test_predicted_albedo_is_wrong_alike_in_all_views_but_for_a_scale_of_each(views: list[View]) -> None:
    """The error of a place is one, whichever view shows it: here, of the same view twice, only the scale differs."""
    views = [replace(view, albedo=torch.full_like(view.image, 0.4)) for view in views]
    first, second = degraded([views[0], views[0]], ViewErrors(albedo_error=0.1))
    off = [torch.log(one.albedo / views[0].albedo).reshape(-1, 3) for one in (first, second)]
    assert float((off[0] - off[1]).std(dim=0).amax()) < 1e-5
    assert float((off[0] - off[1]).mean().abs()) > 0.01  # measured 0.13
    many = torch.cat(
        [torch.log(one.albedo / 0.4).reshape(-1, 3) for one in degraded(views, ViewErrors(albedo_error=0.1))]
    )
    assert float(many.std()) == pytest.approx(0.1 * 2**0.5, rel=0.4)
    assert degraded(views[:1], ViewErrors(albedo_error=0.1))[0].image is views[0].image
