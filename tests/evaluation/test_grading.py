"""Scenes are graded by what is wrong with them: by errors that pixels share, not by noise, and by what is guessed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from half_seen_room import only
from rgspipe.evaluation.grading import grade_scene, graded_words, structured_error
from rgspipe.evaluation.metrics import peak, psnr
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rgspipe.scene.grade import Grade, SceneGrade
from rooms import closed_box

#: A camera in the middle of a box, that looks at its side at x = 0.5.
INSIDE = Camera.look_at([0, 0, 0], [0.5, 0, 0], fov_degrees=100.0, width=32, height=32)

GOOD = SceneGrade(
    psnr=43.0, views=24, residual=0.009, guessed=0.02, doubt=0.004, missing=0.0, at_bound=0.0, unseen_at=(0.5, 0.0, 0.0)
)


def picture(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.5, 1.5, size=(64, 96, 3))


def test_noise_of_the_photographs_is_no_error_of_the_scene():
    truth = picture()
    noisy = [truth + 0.3 * np.random.default_rng(seed).standard_normal(truth.shape) for seed in range(8)]
    # Measured 0.009: plain it is 0.28.
    assert structured_error([truth] * 8, noisy) < 0.02


def test_a_smooth_error_is_measured_with_noise_on_top():
    truth = picture()
    ramp = np.linspace(0.8, 1.2, 96)[None, :, None]
    plain = float(np.sqrt(np.square(truth * (ramp - 1.0)).sum() / np.square(truth).sum()))
    found = structured_error([truth * ramp] * 4, [truth] * 4)
    # Measured 0.958 of it, and 0.951 with noise on top: what the texture of the picture adds to it is no shared error.
    assert found == pytest.approx(plain, rel=0.05)
    noisy = [truth + 0.2 * np.random.default_rng(seed).standard_normal(truth.shape) for seed in range(4)]
    assert structured_error([truth * ramp] * 4, noisy) == pytest.approx(plain, rel=0.1)


def test_black_views_prove_nothing():
    black = np.zeros((16, 16, 3))
    assert structured_error([black], [black]) == 1.0


@pytest.mark.parametrize("size", [(7, 40), (9, 8)])
def test_images_of_any_size_are_judged(size):
    truth = np.ones((*size, 3))
    assert structured_error([1.1 * truth], [truth]) == pytest.approx(0.1 if min(size) >= 8 else 0.0, abs=1e-12)


def test_what_was_guessed_counts_by_how_much_is_seen_of_it():
    box = closed_box(0.1)
    wall = box.normals[:, 0] > 0.9
    for share in (0.0, 0.5):
        marked = replace(box, guessed=share * wall.double())
        frozen = FrozenScene.freeze(marked, gather_rays=64, patches=50)
        grade = grade_scene(frozen, [picture()], [picture()], cameras=[INSIDE], psnr=None, highest_albedo=0.98)
        # A wall of a cube fills 0.2 of what the other walls see.
        assert grade.guessed == pytest.approx(0.2 if share else 0.0, abs=0.01)  # measured 0.2003
        assert grade.doubt == pytest.approx(share * grade.guessed, rel=1e-5) and grade.at_bound == 0.0
        assert grade.missing < 1e-3  # measured 0
        # The wall whose normal is +x stands at x = −0.5. Measured (−0.50, 0.05, −0.06).
        assert grade.unseen_at == (pytest.approx((-0.5, 0.0, 0.0), abs=0.1) if share else None)


def test_noise_makes_no_scene_bad_and_an_error_of_the_same_psnr_makes_it_poor():
    truth, frozen = picture(), FrozenScene.freeze(closed_box(0.1), gather_rays=16, patches=50)
    # 9.7 dB: what a training that failed reached.
    size = peak(truth) * 10.0 ** (-9.7 / 20.0)
    shading = np.sign(np.linspace(-1.0, 1.0, 96))[None, :, None] * size
    noise = [size * np.random.default_rng(seed).standard_normal(truth.shape) for seed in range(8)]
    grades = []
    for errors in ([shading] * 8, noise):
        images = [truth + error for error in errors]
        assert psnr(images[0], truth) == pytest.approx(9.7, abs=0.1)
        one = grade_scene(frozen, images, [truth] * 8, cameras=[INSIDE], psnr=9.7, highest_albedo=0.98)
        grades.append((one.grade, one.residual))
    (poor, residual), (good, left) = grades
    assert poor is Grade.POOR and residual == pytest.approx(size / np.sqrt(np.square(truth).mean()), rel=0.01)
    assert good is Grade.GOOD and left < 0.1 * residual, left


def test_a_wall_that_is_not_there_is_missing_where_nobody_looked():
    box = closed_box(0.1)
    frozen = FrozenScene.freeze(only(box, box.normals[:, 0] < 0.9), gather_rays=64, patches=50)
    judged = {"images": [picture()], "truths": [picture()], "psnr": None, "highest_albedo": 0.98}
    grade = grade_scene(frozen, cameras=[INSIDE], **judged)
    assert grade.missing == pytest.approx(0.2, abs=0.02) and grade.grade is Grade.FAIR  # measured 0.195
    assert "20 % of what surfaces look at was seen by no camera and is left open" in graded_words(grade)
    assert grade.unseen_at == pytest.approx((-0.5, 0.0, 0.0), abs=0.1)
    outwards = Camera.look_at([0.4, 0, 0], [-0.5, 0, 0], fov_degrees=100.0, width=32, height=32)
    assert grade_scene(frozen, cameras=[INSIDE, outwards], **judged).grade is Grade.GOOD


def test_albedo_at_its_bound_is_told_by_area():
    box = closed_box(0.1)
    albedo = torch.where((box.normals[:, 2] > 0.9)[:, None], 0.98, 0.5).expand(-1, 3)
    frozen = FrozenScene.freeze(replace(box, albedo=albedo), gather_rays=16, patches=50)
    grade = grade_scene(frozen, [picture()], [picture()], cameras=[INSIDE], psnr=None, highest_albedo=0.98)
    assert grade.at_bound == pytest.approx(1 / 6, rel=0.05)  # measured 0.1661
    assert "the albedo of 17 % is as high as it may be" in graded_words(grade)


@pytest.mark.parametrize(
    ("change", "grade", "advice"),
    [
        ({}, Grade.GOOD, None),
        ({"residual": 0.2}, Grade.FAIR, "Check poses, lamps and exposure"),
        ({"doubt": 0.25}, Grade.FAIR, "Photograph what no view shows"),
        ({"residual": 0.6}, Grade.POOR, "Check poses, lamps and exposure"),  # as in renders of 10 dB
        ({"missing": 0.35}, Grade.POOR, "Photograph what no view shows"),
        ({"at_bound": 0.5}, Grade.POOR, "Photograph what no view shows"),
        ({"at_bound": 0.5, "unseen_at": None}, Grade.POOR, "Check the power of the lamps"),
        ({"residual": 0.2, "scale": 0.1}, Grade.FAIR, "Check poses, depth, exposures and the tone curve"),
        ({"at_bound": 0.5, "unseen_at": None, "scale": 0.1}, Grade.POOR, "a lamp or a window that was not found"),
    ],
)
def test_the_grade_is_the_error_that_lights_are_expected_to_have(change, grade, advice):
    found = replace(GOOD, **change)
    words = graded_words(found)
    assert found.grade is grade and words.startswith(
        f"The scene is {grade}: lights found by bounced light are expected"
    )
    assert (advice in words) if advice else words.endswith(".") and "Photograph" not in words
    assert ("around (0.50, 0.00, 0.00)" in words) == ("Photograph" in words)
