"""Recovered lights beside their truth, for the tests of tables, figures and pages."""

import numpy as np
import pandas as pd
import torch

from rgspipe.evaluation import convergence
from rgspipe.evaluation.tables import target_table
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
            courses.append(convergence.convergence_table(curve, row, estimates[name], truths[name], 1.0))
    table = target_table(pd.DataFrame(rows), estimates, truths, 1.0)
    return table, pd.concat(courses, ignore_index=True)
