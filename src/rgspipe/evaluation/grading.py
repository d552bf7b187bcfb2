"""Grades a scene by its renders, by what was guessed of it, and by its albedo; and says the grade in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from rgspipe.evaluation.arrays import ArrayLike, to_array
from rgspipe.evaluation.escaped_light import escaped_light
from rgspipe.percent import percent
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.camera import Camera
from rgspipe.scene.grade import Grade, KnownLamps, SceneGrade

#: Pixels along the side of a block whose error is one. Edges of things are errors of a pixel or two, and move no light
#: that is found by what bounces. Blocks half and twice as large find 1.30 and 0.75 times as much error in a trained
#: Cornell box.
BLOCK = 8

#: Radius of the place where a photograph would help most, in parts of the scene's size: a whole wall of a
#: room. And how many such places are tried.
PLACE, BALLS = 0.5, 256

#: Less of the light than this is not worth a word: some passes between surfels where walls meet.
LEAST = 0.005

#: Albedo this near to its upper bound is at it.
NEAR_BOUND = 1e-3


def grade_scene(
    frozen: FrozenScene,
    images: Sequence[ArrayLike],
    truths: Sequence[ArrayLike],
    *,
    cameras: Sequence[Camera],
    psnr: float | None,
    highest_albedo: float,
) -> SceneGrade:
    """The grade of a scene.

    Args:
        frozen: with its gather operator.
        images, truths: renders (H, W, 3) of views under their lights, and what they should be.
        cameras: those that the scene was made from.
        psnr: of them, dB, if they were left out of training.
        highest_albedo: that training allows.
    """
    surfels, seen = frozen.surfels, frozen.surfels.guessed == 0.0
    area = (frozen.areas * seen).double()
    area = area / area.sum().clamp(min=1e-300)
    looked_at = (frozen.gather.transposed @ area.float()[:, None])[:, 0].double()
    guessed, doubts = looked_at * ~seen, looked_at * surfels.guessed
    escaped = escaped_light(frozen, cameras)
    at_bound = float(area[(surfels.albedo >= highest_albedo - NEAR_BOUND).any(dim=1)].sum())
    places = torch.cat([surfels.centers.double()[~seen].cpu(), escaped.places])
    return SceneGrade(
        psnr,
        len(images),
        residual=structured_error(images, truths),
        guessed=float(guessed.sum()),
        doubt=float(doubts.sum()),
        missing=float(escaped.shares.sum()),
        at_bound=at_bound,
        unseen_at=_fullest(places, torch.cat([doubts[~seen].cpu(), escaped.shares]), PLACE * frozen.size),
    )


def _fullest(places: Tensor, weights: Tensor, radius: float) -> tuple[float, float, float] | None:
    """The middle of what the ball around one of `places` (P, 3) that holds most of `weights` (P,) holds of them.

    None where all weights together are less than LEAST.
    """
    if float(weights.sum()) < LEAST:
        return None
    tried = places[:: max(1, len(places) // BALLS)]
    near = torch.cdist(tried, places) <= radius
    held = near[(near.double() @ weights).argmax()]
    x, y, z = ((places[held] * weights[held, None]).sum(dim=0) / weights[held].sum()).tolist()
    return x, y, z


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
    return float(np.sqrt(max(0.0, shared) / energy)) if energy > 0.0 else 1.0


def _two_means(error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(A, B, 3) means over both halves of each whole block of an error (H, W, 3)."""
    high, wide = error.shape[0] // BLOCK, error.shape[1] // BLOCK
    blocks = error[: high * BLOCK, : wide * BLOCK].reshape(high, BLOCK, wide, BLOCK, 3).transpose(0, 2, 1, 3, 4)
    white = np.indices((BLOCK, BLOCK)).sum(axis=0) % 2 == 0
    return blocks[:, :, white].mean(axis=2), blocks[:, :, ~white].mean(axis=2)


def graded_words(grade: SceneGrade) -> str:
    """Sentences: the grade, why it is so, and what to do where it is not good."""
    parts = [
        (grade.residual, f"renders are {percent(grade.residual, 0)} off, noise apart"),
        (grade.doubt, f"{percent(grade.guessed, 0)} of what surfaces look at was seen by no camera and is guessed"),
        (grade.missing, f"{percent(grade.missing, 0)} of what surfaces look at was seen by no camera and is left open"),
        (
            grade.at_bound,
            f"the albedo of {percent(grade.at_bound, 0)} is as high as it may be, as if light were missing",
        ),
    ]
    reasons = "; ".join([words for size, words in sorted(parts, reverse=True) if size >= LEAST] + _lamps(grade.lamps))
    error = f"lights found by bounced light are expected to be {100.0 * grade.error:.1f} % of its size off"
    words = f"The scene is {grade.grade}: {error}" + (f" ({reasons})." if reasons else ".")
    return words if grade.grade is Grade.GOOD else f"{words} {_advice(grade)}"


def _lamps(lamps: KnownLamps | None) -> list[str]:
    if lamps is None:
        return []
    found = [] if lamps.error is None else [f"known lamps are found {100.0 * lamps.error:.1f} % off"]
    widened = [f"regions are {lamps.excess:.1f} times as wide, as they left known lamps out"]
    return found + (widened if lamps.excess > 1.0 else [])


def _advice(grade: SceneGrade) -> str:
    if grade.error > grade.light_error:
        return "Its light looks right, and yet lamps that are known are found elsewhere: take more photographs of it."
    captured = grade.scale > 0.0  # under lamps that nobody measured, by a search that does not go on
    if grade.residual >= max(grade.doubt, grade.missing, grade.at_bound):
        if captured:
            return "Check poses, depth, exposures and the tone curve of the photographs, or take more surfels."
        return "Check poses, lamps and exposure of the training images, or train longer."
    if grade.unseen_at is None:
        if captured:
            return (
                "Light is missing that no lamp explains: a lamp or a window that was not found, or lamps inside of "
                "what depth shows."
            )
        return (
            "Check the power of the lamps and the exposure of the training images: the scene seems too bright for them."
        )
    place = ", ".join(f"{value:.2f}" for value in grade.unseen_at)
    return f"Photograph what no view shows, first of all around ({place}); the report draws guesses in colour."
