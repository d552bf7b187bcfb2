"""Grades a scene by its renders, by what was guessed of it, and by its albedo; and says the grade in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.grade import Grade, SceneGrade

#: Pixels along the side of a block whose error is one. Edges of things are errors of a pixel or two, and move no light
#: that is found by what bounces. Blocks half and twice as large find 1.30 and 0.75 times as much error in a trained
#: Cornell box.
BLOCK = 8

#: Albedo this near to its upper bound is at it.
NEAR_BOUND = 1e-3


def grade_scene(
    frozen: FrozenScene,
    images: Sequence[ArrayLike],
    truths: Sequence[ArrayLike],
    *,
    psnr: float | None,
    highest_albedo: float,
) -> SceneGrade:
    """The grade of a scene.

    Args:
        frozen: with its gather operator.
        images, truths: renders (H, W, 3) of views under their lights, and what they should be.
        psnr: of them, dB, if they were left out of training.
        highest_albedo: that training allows.
    """
    surfels, seen = frozen.surfels, frozen.surfels.guessed == 0.0
    area = (frozen.areas * seen).double()
    area = area / area.sum().clamp(min=1e-300)
    marks = torch.stack([(~seen).float(), surfels.guessed.float()], dim=1)
    guessed, doubt = (area[:, None] * (frozen.gather @ marks).double()).sum(dim=0).tolist()
    at_bound = float(area[(surfels.albedo >= highest_albedo - NEAR_BOUND).any(dim=1)].sum())
    return SceneGrade(psnr, len(images), structured_error(images, truths), guessed, doubt, at_bound)


def structured_error(images: Sequence[ArrayLike], truths: Sequence[ArrayLike]) -> float:
    """Root mean square over that of `truths`, of the part of the error that neighbouring pixels share.

    In each block the means of the error over the white and over the black fields of a chessboard are multiplied: noise
    that each pixel has to itself cancels out, whatever its size.
    """
    shared = energy = 0.0
    for image, truth in zip(images, truths, strict=True):
        true = to_array(truth).astype(np.float64)
        white, black = _two_means(to_array(image).astype(np.float64) - true)
        pixels = BLOCK**2 * white.shape[0] * white.shape[1]
        shared += BLOCK**2 * float((white * black).sum()) * true.shape[0] * true.shape[1] / max(1, pixels)
        energy += float(np.square(true).sum())
    return float(np.sqrt(max(0.0, shared) / energy)) if energy > 0.0 else 0.0


def _two_means(error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(A, B, 3) means over both halves of each whole block of an error (H, W, 3)."""
    high, wide = error.shape[0] // BLOCK, error.shape[1] // BLOCK
    blocks = error[: high * BLOCK, : wide * BLOCK].reshape(high, BLOCK, wide, BLOCK, 3).transpose(0, 2, 1, 3, 4)
    white = np.indices((BLOCK, BLOCK)).sum(axis=0) % 2 == 0
    return blocks[:, :, white].mean(axis=2), blocks[:, :, ~white].mean(axis=2)


def graded_words(grade: SceneGrade) -> str:
    """Sentences: the grade, why it is so, and what to do where it is not good."""
    parts = [
        (grade.residual, f"renders are {_percent(grade.residual)} off, noise apart"),
        (grade.doubt, f"{_percent(grade.guessed)} of what surfaces look at was seen by no camera and is guessed"),
        (grade.at_bound, f"the albedo of {_percent(grade.at_bound)} is as high as it may be, as if light were missing"),
    ]
    reasons = "; ".join(words for size, words in sorted(parts, reverse=True) if size >= 0.005)
    error = f"lights found by bounced light are expected to be {100.0 * grade.error:.1f} % of its size off"
    words = f"The scene is {grade.grade}: {error}" + (f" ({reasons})." if reasons else ".")
    return words if grade.grade is Grade.GOOD else f"{words} {_advice(grade)}"


def _advice(grade: SceneGrade) -> str:
    if grade.residual >= max(grade.doubt, grade.at_bound):
        return "Check poses, lamps and exposure of the training images, or train longer."
    return "Photograph what no view shows: the report's drawing of the dataset has it in colour."


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
