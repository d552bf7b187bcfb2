"""Fits in a few rooms of the zoo, as a study gathers them."""

from __future__ import annotations

import math
from functools import cache

import pandas as pd

from rgspipe.evaluation.tables import TARGET_COLUMNS
from rgspipe.scene.models.zoo import draw_room
from rgspipe.studies.zoo import MEASURED, failed_rows, fit_rows, fits_table, summary
from rgspipe.studies.zoo_rooms import part_of, room_properties

CLASSES = ("visible", "out_of_frame", "occluded")


def room_of(seed: int, **known: object) -> dict[str, object]:
    """What is known of a room, as `stages.study_zoo` has it."""
    room = {"seed": seed, "part": part_of(seed), "case": "clean"} | room_properties(draw_room(seed))
    room |= {"train_views": 40, "noise": 0.02, "lens": 50.0, "stand": "among", "unseen": 0.1, "guessed": 0.2}
    room |= {"surfels": 9000, "held_out_psnr": 35.0, "training_seconds": 90.0}
    return room | {"grade": "fair", "grade_error": 0.02} | known


def targets(views: int, errors: tuple[float, ...], inside: bool = True, result: str = "converged") -> pd.DataFrame:
    """A target of each class, with these errors."""
    rows = [
        dict.fromkeys(TARGET_COLUMNS, math.nan)
        | {"target": f"{name}_000", "occlusion": name, "method": "search_lm", "views": views}
        | {"position_error": error, "intensity_error": 0.02, "seconds": 0.5, "success": error <= 0.01}
        | {"position_sd": error, "noise_sd": 0.5 * error, "noise_allows": 0.5 * error <= 0.01}
        | {"inside_95": inside, "result": result, "reason": ""}
        for name, error in zip(CLASSES, errors, strict=False)
    ]
    return pd.DataFrame(rows).astype(dict.fromkeys(("success", "noise_allows", "inside_95"), "boolean"))


def five_rooms() -> pd.DataFrame:
    """Seeds 1 to 5: the first is silently wrong once, the second failed in training, the fifth could not be built."""
    rows = []
    for views in (1, 3):
        rows += fit_rows(room_of(1, train_views=30, lens=35.0), targets(views, (0.002, 0.004, 0.05), inside=False))
        lost = room_of(2, **dict.fromkeys((*MEASURED, "grade")))
        rows += failed_rows(lost, CLASSES, "search_lm", views, "train_surfels", "the loss is NaN")
        rows += fit_rows(room_of(3, train_views=80, unseen=0.4, grade="good"), targets(views, (0.02, 0.03, 0.04)))
        rows += fit_rows(room_of(4, train_views=60), targets(views, (0.001, 0.002, 0.003)))
        nowhere = room_of(5, **dict.fromkeys((*MEASURED, "stand", "grade")))
        rows += failed_rows(nowhere, CLASSES, "search_lm", views, "generate_dataset", "no place | for a camera")
    return fits_table(rows)


@cache
def five_rooms_figures() -> pd.DataFrame:
    """Their summary; made once, as a hundred intervals take a second."""
    return summary(five_rooms(), 0, resamples=50)
