"""A small but complete set of results for the tests of pages."""

import numpy as np
import pandas as pd
import pytest
import torch

from fitted_lights import make_fitted
from rgspipe.datasets.views import Target, View
from rgspipe.evaluation import images
from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.held_out import QUALITY
from rgspipe.evaluation.light_plot import CameraMark
from rgspipe.evaluation.summary import summary_table
from rgspipe.pages import report
from rgspipe.pages.gallery import make_gallery
from rgspipe.pages.provenance import stage_record
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.models import CornellBox, exact_surfels

LIGHT = PointLight(torch.tensor([0.1, -0.2, 0.3]), torch.tensor([1.0, 1.5, 2.0]))
#: Measures of a study besides its quality.
STUDY = (*QUALITY, "position_error", "intensity_error", "solved")


def make_view(name: str, light: PointLight | None = None) -> View:
    """A view of 16 × 8 pixels."""
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.5, -1.5, 0.5]), torch.full((3,), 0.5)), 0.7, 16, 8)
    return View(
        name, camera, torch.rand(8, 16, 3, generator=torch.Generator().manual_seed(0)), torch.ones(8, 16), light
    )


def make_contents() -> report.ReportContents:
    """Everything that a report can show."""
    parts = [make_fitted(1), make_fitted(3)]
    targets = pd.concat([part[0] for part in parts], ignore_index=True)
    image = np.random.default_rng(0).uniform(size=(16, 16, 3))
    png = images.png_bytes(images.comparison_strip(image, image))
    rows = [{"surfels": name, "light": "pixels"} | dict.fromkeys(QUALITY, 38.25) for name in ("trained", "truth")]
    quality = pd.DataFrame(rows)
    split = pd.DataFrame({"kind": KINDS, "pixels": 0.25, "error": 0.25, "psnr": 40.0, "light": "pixels"})
    split = split.assign(surfels="trained")
    views = tuple(make_view(f"train/r_{index:04d}", LIGHT) for index in range(8))
    targets_seen = tuple(Target(f"{name}_000", name, (make_view("view_0"),)) for name in ("occluded", "visible"))
    study = pd.DataFrame([{"case": case} | dict.fromkeys(STUDY, 0.5) for case in ("clean", "views=25")])
    study = study.assign(scene="cornell", factor=1.5)
    manifest = {"fingerprint": "0123abcd", "seconds": 3.25, "peak_memory_mib": 640, "libraries": {"torch": "2.13.0"}}
    return report.ReportContents(
        scene="cornell",
        summary=summary_table(targets, seed=0, resamples=200),
        targets=targets,
        curves=pd.concat([part[1] for part in parts], ignore_index=True),
        fits=[report.FitPicture("search_lm, 1 view", "visible_000, median of its class", png)],
        is_measured=True,
        surfels=exact_surfels(CornellBox(), 500),
        cameras=[CameraMark((0.5, -2.0, 0.5), (0.0, 1.0, 0.0), 0.7)],
        training={"test_psnr_mean": 36.5, "seconds": 200.0, "per_view": [{"name": "test/r_0001", "psnr": 33.25}]},
        training_log=pd.DataFrame({"kind": ["albedo", "gradient"], "loss": [1.0, 0.1], "psnr": [20.0, 30.0]}),
        comparison=png,
        quality=quality,
        split=split,
        gallery=make_gallery(views, 2, targets_seen, {"visible_000": (LIGHT,)}, {"visible_000": 0.0123}, png),
        study=study,
        true_summary=summary_table(make_fitted(1, seed=1)[0], seed=0, resamples=0),
        configuration='{"scene": {"name": "<cornell>"}}',
        stages=[stage_record("freeze", manifest)],
        notes=["One note."],
    )


@pytest.fixture
def fitted():
    """`fitted(views, seed=0, with_truth=True)`: (target table, convergence table) of three targets a class."""
    return make_fitted


@pytest.fixture
def full_contents() -> report.ReportContents:
    """Everything that a report can show."""
    return make_contents()


@pytest.fixture(scope="session")
def full_report() -> str:
    """The report of that, as HTML; reports of equal contents are equal, so it is made once."""
    return report.render_report(make_contents())
