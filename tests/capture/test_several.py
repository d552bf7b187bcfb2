"""Several lightings of one room, and one with the lamps off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from photographed_room import LAMPS, painted_room, pictures, radiance_under
from rgspipe.capture.captured import Captured, capture_scenes
from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.options import CaptureOptions
from rgspipe.datasets.views import View
from rgspipe.errors import InputError

OPTIONS = CaptureOptions(gather_rays=128, supersampling=2, grid=4, count=1, unseen=False)


def captured(*views: View) -> list[Captured]:
    surfels = painted_room()
    return capture_scenes(views, replace(surfels, albedo=torch.full_like(surfels.albedo, 0.5)), OPTIONS)


def named(lighting: str, views: list[View]) -> list[View]:
    return [replace(view, lighting=lighting) for view in views]


def test_what_others_measured_is_a_prior_of_the_field() -> None:
    """Against the dense joint distribution of two captures of a chain of surfels."""
    count, rng = 30, np.random.default_rng(0)
    graph = Graph(np.arange(count - 1), np.arange(1, count), np.ones(count - 1), np.zeros(count, dtype=np.int64))
    weights, residuals = rng.uniform(1.0, 50.0, (2, count)), rng.normal(size=(2, count))
    prior = graph.precision(Variances()).toarray()
    joint = np.kron(np.ones((2, 2)), np.linalg.inv(prior)) + np.diag(1.0 / weights.reshape(-1))
    together = residuals.reshape(-1) @ np.linalg.solve(joint, residuals.reshape(-1))
    alone = residuals[1] @ np.linalg.solve(joint[count:, count:], residuals[1])
    mean = np.linalg.solve(prior + np.diag(weights[1]), weights[1] * residuals[1])
    noise = Variances().noise
    field = Field(graph, 1.0 / weights[0] - noise, np.ones(count), Variances(), known=weights[1])
    own = (residuals[0] - mean)[:, None]
    assert float((own * field.whitened(own)).sum()) == pytest.approx(together - alone, rel=1e-9)
    posterior = np.linalg.inv(prior + np.diag(weights.sum(axis=0)))
    assert np.allclose(mean + field.mean(own)[:, 0], posterior @ (weights * residuals).sum(axis=0))
    assert np.allclose(field.deviation(4000, 0), np.sqrt(np.diag(posterior)), rtol=0.06)  # 1/√8000


def albedo_error(found: Captured) -> float:
    used = found.answer.best.problem.field.weight > 0.0
    off = np.log(found.surfels.albedo.numpy() / painted_room().albedo.numpy())[used]
    return float(np.sqrt((off - np.median(off)).var()))


@pytest.mark.slow
def test_two_lightings_are_surer_of_the_albedo_than_one() -> None:
    lit = [named(name, pictures(radiance_under([lamp]))) for name, lamp in zip(("", "2"), LAMPS, strict=True)]
    alone, both = captured(*lit[0])[0], captured(*lit[0], *lit[1])
    assert [one.lighting for one in both] == ["", "2"]
    # Measured: 0.0007 and 0.0013 of a room of side 1; 0.0004 alone.
    for one, lamp in zip(both, LAMPS, strict=True):
        assert float((one.lamps[0].position - lamp.position).norm()) < 0.005
    # 0.0025 of 0.0026. The albedo is 0.8 % off, and was 0.6 %: shadows of the second lamp have edges, too.
    assert float(both[0].doubt.median()) < float(alone.doubt.median())
    assert albedo_error(both[0]) < 0.012


def test_what_shines_with_the_lamps_off_is_taken_away() -> None:
    window = (painted_room().centers - torch.tensor([-0.5, 0.1, 0.1])).norm(dim=1) < 0.2
    glow = torch.where(window[:, None], 1.0, 0.0).expand(-1, 3)
    nothing = [replace(LAMPS[0], intensity=torch.zeros(3))]
    on = pictures(radiance_under(LAMPS[:1], glow))
    off = named("off", pictures(radiance_under(nothing, glow)))
    (found,) = captured(*on, *off)
    error = float((found.lamps[0].position - LAMPS[0].position).norm())
    ratio = float((found.lamps[0].intensity / LAMPS[0].intensity).mean())
    assert error < 0.02 and abs(ratio - 1.0) < 0.06
    assert found.oddities.glowing is None or found.oddities.glowing.share < 0.02


def test_lamps_off_need_one_exposure_and_others_beside_them() -> None:
    views = named("off", pictures(radiance_under(LAMPS[:1]), 3, 8))
    with pytest.raises(InputError, match="only the latter"):
        captured(*views)
    with pytest.raises(InputError, match=r"CaptureOptions\.exposure"):
        capture_scenes([*views, replace(views[0], lighting="")], painted_room(), replace(OPTIONS, exposure="free"))
