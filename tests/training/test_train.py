"""Materials and geometry from images that the renderer made itself, so that the truth is known exactly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from painted_room import LIGHT, painted_box, painted_views
from rgspipe.datasets.views import View
from rgspipe.training.checkpoint import Checkpoint
from rgspipe.training.density import DensityOptions
from rgspipe.training.materials import fit_materials
from rgspipe.training.refine import RefineOptions
from rgspipe.training.trainer import train

OPTIONS = LIGHT


@pytest.fixture(scope="module")
def views() -> list[View]:
    return painted_views()


def test_albedo_is_recovered_with_bounces_and_not_without(views: list[View]) -> None:
    truth = painted_box()
    grey = replace(truth, albedo=torch.full_like(truth.albedo, 0.5))
    found = fit_materials(grey, views, OPTIONS).surfels.albedo
    direct = fit_materials(grey, views, OPTIONS, bounces=False).surfels.albedo
    error = (found - truth.albedo).abs().median()
    direct_error = (direct - truth.albedo).abs().median()
    # Measured medians: 0.004 with bounces, 0.28 without: a room without interreflection must be painted lighter.
    assert float(error) < 0.01
    assert float(direct_error) > 0.05


@pytest.mark.parametrize("killed_at", [3, 4, 6])
def test_training_goes_on_from_a_checkpoint_as_if_never_interrupted(
    views: list[View], tmp_path: Path, killed_at: int
) -> None:
    """Killed between two rounds, within one, and after the last step; some surfels split on the way."""
    start = replace(painted_box(), albedo=torch.full((864, 3), 0.5))
    refine_options = RefineOptions(
        steps=6, relight_every=3, views_per_step=4, interior_pixels=100, subsamples=1, tilt_rate=0.01, height_rate=0.01
    )
    options = replace(OPTIONS, rounds=2, refine=refine_options, light_rounds=1, density=DensityOptions(growth=1.1))
    whole = train(start, views, options)

    class Killed(Exception):
        pass

    class KillingCheckpoint(Checkpoint):
        def save(self, *arguments: object) -> None:
            super().save(*arguments)
            if arguments[2] is not None and arguments[2].step == killed_at:
                raise Killed

    with pytest.raises(Killed):
        train(start, views, options, KillingCheckpoint(tmp_path / "state", every=2))
    resumed = train(start, views, options, Checkpoint(tmp_path / "state", every=2))
    assert len(whole.surfels) > len(start)
    for name, tensor in whole.surfels.tensors().items():
        assert torch.equal(tensor, resumed.surfels.tensors()[name]), name
    assert [record.step for record in resumed.records] == [record.step for record in whole.records]
