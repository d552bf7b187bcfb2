"""A small but complete set of results for the tests of figures and report."""

import numpy as np
import pandas as pd
import pytest
import torch

from rgspipe.evaluation import convergence, images, plots, report, tables
from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.held_out import QUALITY
from rgspipe.scene import PointLight


def make_fitted(views: int, seed: int = 0, with_truth: bool = True) -> tuple[pd.DataFrame, pd.DataFrame]:
    """(target table, convergence table) of three targets a class."""
    generator = np.random.default_rng(seed)
    rows, estimates, truths, courses = [], {}, {}, []
    for occlusion in ("visible", "out_of_frame", "occluded"):
        for index in range(3):
            name = f"{occlusion}_{index:03d}"
            true, found = generator.uniform(0.1, 0.9, 3), generator.normal(0.0, 0.01 / views, 3)
            truths[name] = (PointLight(torch.tensor(true), torch.ones(3)),) if with_truth else ()
            estimates[name] = (PointLight(torch.tensor(true + found), torch.ones(3)),)
            row = {"target": name, "occlusion": occlusion, "method": "search_lm", "views": views}
            rows.append(row | {"seconds": 1.5, "psnr": 35.0, "result": "converged", "reason": "small <step>"})
            path = true + found + np.geomspace(0.5, 1e-4, 6)[:, None]
            curve = pd.DataFrame(path, columns=list("xyz")).assign(step=range(6), loss=np.geomspace(1.0, 0.01, 6))
            courses.append(convergence.convergence_table(curve, row, truths[name], 1.0))
    table = tables.target_table(pd.DataFrame(rows), estimates, truths, 1.0)
    return table, pd.concat(courses, ignore_index=True)


def make_contents() -> report.ReportContents:
    """Everything that a report can show."""
    parts = [make_fitted(1), make_fitted(3)]
    targets = pd.concat([part[0] for part in parts], ignore_index=True)
    image = np.random.default_rng(0).uniform(size=(16, 16, 3))
    png = images.png_bytes(images.comparison_strip(image, image))
    cloud = np.random.default_rng(1).uniform(size=(500, 3))
    rows = [{"surfels": name, "light": "pixels"} | dict.fromkeys(QUALITY, 38.25) for name in ("trained", "truth")]
    quality = pd.DataFrame(rows)
    split = pd.DataFrame({"kind": KINDS, "pixels": 0.25, "error": 0.25, "psnr": 40.0, "light": "pixels"})
    split = split.assign(surfels="trained")
    manifest = {"fingerprint": "0123abcd", "seconds": 3.25, "peak_memory_mib": 640, "libraries": {"torch": "2.13.0"}}
    return report.ReportContents(
        scene="cornell",
        summary=tables.summary_table(targets, seed=0, resamples=200),
        targets=targets,
        curves=pd.concat([part[1] for part in parts], ignore_index=True),
        fits=[report.Picture("search_lm, 1 view", "visible_000, median of its class", png)],
        cloud=cloud,
        normals=np.tile([0.0, 0.0, 1.0], (500, 1)),
        cameras=[plots.CameraMark((0.5, -2.0, 0.5), (0.0, 1.0, 0.0), 0.7)],
        training={"test_psnr_mean": 36.5, "seconds": 200.0, "per_view": [{"name": "test/r_0001", "psnr": 33.25}]},
        training_log=pd.DataFrame({"kind": ["albedo", "gradient"], "loss": [1.0, 0.1], "psnr": [20.0, 30.0]}),
        comparison=png,
        quality=quality,
        split=split,
        true_summary=tables.summary_table(make_fitted(1, seed=1)[0], seed=0, resamples=0),
        configuration='{"scene": {"name": "<cornell>"}}',
        stages=[report.stage_record("freeze", manifest)],
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
