"""Materials and geometry from images that the renderer made itself, so that the truth is known exactly."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from painted_room import LIGHT, painted_box, painted_views
from rgspipe.datasets.views import View
from rgspipe.training.checkpoint import Checkpoint
from rgspipe.training.materials import fit_materials
from rgspipe.training.record import Record, materials_seconds
from rgspipe.training.trainer import Trained, train

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


def split_on_the_way(views: list[View], checkpoint: Checkpoint | None = None) -> Trained:
    """A training of two rounds, in which some surfels split."""
    start = replace(painted_box(), albedo=torch.full((864, 3), 0.5))
    steps = {"steps": 6, "relight_every": 3, "growth": 1.1, "tilt_rate": 0.01, "height_rate": 0.01}
    pixels = {"views_per_step": 4, "interior_pixels": 100, "subsamples": 1}
    options = replace(OPTIONS, rounds=2, light_rounds=1, **steps, **pixels)
    return train(views, start, options, checkpoint=checkpoint)


@pytest.fixture(scope="module")
def whole(views: list[View]) -> Trained:
    """That training, never interrupted."""
    return split_on_the_way(views)


@pytest.mark.slow
@pytest.mark.parametrize("killed_at", [3, 4, 6])
def test_training_goes_on_from_a_checkpoint_as_if_never_interrupted(
    views: list[View], whole: Trained, tmp_path: Path, killed_at: int
) -> None:
    """Killed between two rounds, within one, and after the last step."""

    class Killed(Exception):
        pass

    class KillingCheckpoint(Checkpoint):
        def save(self, *arguments: object) -> None:
            super().save(*arguments)
            if arguments[2] is not None and arguments[2].step == killed_at:
                raise Killed

    with pytest.raises(Killed):
        split_on_the_way(views, KillingCheckpoint(tmp_path / "state", every=2))
    resumed = split_on_the_way(views, Checkpoint(tmp_path / "state", every=2))
    assert len(whole.surfels) > len(painted_box())
    for name, tensor in whole.surfels.tensors().items():
        assert torch.equal(tensor, resumed.surfels.tensors()[name]), name
    assert [record.step for record in resumed.records] == [record.step for record in whole.records]
    assert [record.psnr for record in resumed.records] == [record.psnr for record in whole.records]


def test_progress_says_how_training_goes_and_when_it_ends(
    views: list[View], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    shown, estimates = [], []

    class Bar(list):
        def set_postfix_str(self, text: str, refresh: bool) -> None:
            shown.append(text)

    def tracked(items: range, *_: object, after: float, **__: object) -> Bar:
        estimates.append(after)
        return Bar(items)

    monkeypatch.setattr("rgspipe.training.refine.progress_bar", tracked)
    caplog.set_level("INFO")
    start = replace(painted_box(), albedo=torch.full((864, 3), 0.5))
    steps = {"steps": 3, "views_per_step": 4, "interior_pixels": 100, "subsamples": 1}
    trained = train(views, start, replace(OPTIONS, rounds=2, loss="l1", compression=10.0, **steps))
    first, *steps, last = trained.records
    assert [record.phase for record in steps] == 3 * ["geometry"]
    # The mean over steps is of errors; the loss is another measure.
    mean = -10.0 * math.log10(sum(10.0 ** (-record.psnr / 10.0) for record in steps) / 3)
    assert shown[-1] == f"{mean:.1f} dB, 864 surfels"
    assert abs(steps[0].psnr + 10.0 * math.log10(steps[0].loss)) > 3.0
    # Materials at the end take as long as those before.
    assert estimates == [first.seconds] and 0.0 < first.seconds < last.seconds
    assert f"final materials: {last.psnr:.1f} dB on the training images, 864 surfels" in caplog.text
    assert trained.stored.memory > 0 and "MiB in memory" in caplog.text


def test_seconds_of_materials_are_those_of_the_newest_fit() -> None:
    def records(*rows: tuple[str, float]) -> list[Record]:
        return [Record(phase, 0, 0.0, 0.0, seconds) for phase, seconds in rows]

    assert materials_seconds([]) == 0.0
    assert materials_seconds(records(("materials", 3.0))) == 3.0
    lights = ("materials", 3.0), ("materials and lights", 5.0)
    assert materials_seconds(records(*lights, ("geometry", 9.0))) == 5.0
    assert materials_seconds(records(*lights, ("materials", 9.0), ("materials and lights", 10.0))) == 5.0
