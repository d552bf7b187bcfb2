"""Lamps and albedo of a painted room come out of photographs in which both are unknown."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import torch

from photographed_room import LAMPS, painted_room, photographs, pictures, radiance_under
from rgspipe.capture import minima, search
from rgspipe.capture.captured import Captured, capture_scene
from rgspipe.capture.certainty import Certainty
from rgspipe.capture.lamp_file import write_lamps
from rgspipe.capture.minima import RivalLamps
from rgspipe.capture.options import CaptureOptions
from rgspipe.capture.words import captured_words
from rgspipe.datasets.light_file import read_lights
from rgspipe.evaluation.rig_errors import match_positions
from rgspipe.progress import progress_bar

OPTIONS = CaptureOptions(gather_rays=256, supersampling=2, grid=6, most=3)


def blank_room() -> torch.Tensor:
    surfels = painted_room()
    return replace(surfels, albedo=torch.full_like(surfels.albedo, 0.5))


@cache
def found() -> Captured:
    return capture_scene(photographs(), blank_room(), OPTIONS)


def errors(captured: Captured) -> tuple[np.ndarray, np.ndarray]:
    """Distances of the lamps from the true ones over the room's size, and ratios of intensities."""
    places = (np.stack([lamp.position.numpy() for lamp in rig]) for rig in (captured.lamps, LAMPS))
    pairs = [(captured.lamps[own], LAMPS[true]) for own, true in match_positions(*places)]
    distances = [float((a.position - b.position).norm()) / captured.frozen.size for a, b in pairs]
    return np.array(distances), np.array([float(a.intensity.mean() / b.intensity.mean()) for a, b in pairs])


@pytest.mark.slow
def test_both_lamps_are_found_and_no_third() -> None:
    assert len(found().lamps) == 2
    distances, ratios = errors(found())
    assert distances.max() < 0.008, distances  # 0.0050
    assert np.abs(ratios - 1.0).max() < 0.05, ratios  # 0.005


def test_lamps_are_counted_by_steps_alone_and_settle_with_bends() -> None:
    """A lamp that is left out looks like paint that changes slowly: in uneven paint the second one went unseen."""
    answer = found().answer
    assert all(one.more.problem.field.graph.bent is None for one in answer.compared)
    assert answer.best.problem.field.graph.bent is not None


def test_exposures_that_nobody_spoke_of_are_told() -> None:
    assert "differ in exposure" not in captured_words(found()) and "unit of their own" not in captured_words(found())
    cameras = replace(found().measured.cameras, exposure="free", gains=np.linspace(0.8, 1.2, 14)[:, None].repeat(3, 1))
    cameras = replace(cameras, vignetting=True, falloff=np.array([-0.3, 0.0]))
    words = captured_words(replace(found(), measured=replace(found().measured, cameras=cameras)))
    assert "Intensities are in a unit of their own" in words
    assert "differ in exposure, by a factor of up to 1.50" in words and "26 % darker in their corners" in words


@pytest.mark.slow
def test_lamps_that_are_looked_for_on_a_part_of_the_surfels_are_the_same() -> None:
    again = capture_scene(photographs(), blank_room(), replace(OPTIONS, search_surfels=400))
    assert len(again.answer.best.problem.radiance) == len(found().surfels)
    pairs = match_positions(*(np.stack([lamp.position.numpy() for lamp in one.lamps]) for one in (again, found())))
    apart = [float((again.lamps[own].position - found().lamps[other].position).norm()) for own, other in pairs]
    assert max(apart) < 0.005 * found().frozen.size, apart  # 0.0029; 0.0010 before faces ended where they meet
    assert errors(again)[0].max() < 0.008  # 0.0054


def test_the_search_tells_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    bars, problem = [], found().answer.best.problem
    for module in (search, minima):
        monkeypatch.setattr(
            module, "progress_bar", lambda *given, **named: bars.append(progress_bar(*given, **named)) or bars[-1]
        )
    search.found_lamps(problem, 2, 3)
    compared = "comparing places of lamps"
    assert [bar.desc for bar in bars] == ["looking for lamp 1", compared, "looking for lamp 2", compared, compared]
    assert [bar.n for bar in bars] == [bar.total for bar in bars]
    assert [bar.n for bar in bars[:3:2]] == [12, 27]


def test_the_albedo_is_that_of_the_paint() -> None:
    # Surfels that close what no camera saw come after those that were given.
    room = painted_room()
    measured = (found().answer.best.problem.field.weight > 0.0)[: len(room)]
    off = np.log(found().surfels.albedo[: len(room)].numpy() / room.albedo.numpy())[measured]
    assert np.median(np.abs(off)) < 0.015, np.median(np.abs(off))  # 0.0043


def test_a_scene_under_the_found_lamps_looks_as_it_was_photographed() -> None:
    frozen = type(found().frozen).freeze(found().surfels, gather_rays=256)
    view = photographs()[3]
    with torch.no_grad():
        error = (frozen.render(view.camera, found().lamps) - view.image).square().mean().sqrt()
    assert float(error / view.image.square().mean().sqrt()) < 0.05


def test_the_errors_are_those_that_it_says() -> None:
    spread = found().certainty.spread(found().frozen.size)
    assert (errors(found())[0] < 2.0 * spread).all()  # 0.0050 of 0.013
    assert (spread < 0.05).all()
    assert 0.0 < found().certainty.scale < 0.2


def test_the_lamps_are_a_light_file(tmp_path: Path) -> None:
    write_lamps(tmp_path / "lamps.json", found())
    assert read_lights(tmp_path / "lamps.json") == found().lamps
    content = json.loads((tmp_path / "lamps.json").read_text())
    assert len(content["lights"][0]["covariance"]) == 3
    assert content["scale_tied"] == found().certainty.is_tied


def test_the_words_say_what_was_found() -> None:
    words = captured_words(found())
    assert words.startswith("2 lamps were on in the photographs: (")
    assert "known to" in words and "has to explain" in words


def test_surfaces_that_are_saturated_are_told() -> None:
    assert "saturated" not in captured_words(found())
    views = photographs(LAMPS[:1])
    white = float(np.quantile(np.concatenate([view.image.ravel() for view in views]), 0.9))
    clipped = [replace(view, image=view.image.clamp(max=white), saturated_from=white) for view in views]
    captured = capture_scene(clipped, blank_room(), replace(OPTIONS, count=1))
    assert float(captured.measured.blown_out.mean()) > 0.03
    assert "of what surfaces send, the brightest, is saturated" in captured_words(captured)


def test_another_place_that_is_as_likely_is_in_the_region_and_is_told() -> None:
    best = found().answer.best
    places = best.lamps.places.copy()
    places[0] += 0.1 * best.problem.size * np.array([1.0, 0.0, 0.0])
    beside = replace(best, lamps=best.problem.lamps(places, best.lamps.logs))
    plain = replace(found().answer, rivals=())
    before = Certainty.of(plain).spread(best.problem.size)
    for chance, weight in ((0.5, 0.5), (0.2, 0.2), (0.06, 0.128)):  # the region of 95 % ends at 0.128
        answer = replace(plain, rivals=(RivalLamps(beside, chance),))
        spread = Certainty.of(answer).spread(best.problem.size)
        np.testing.assert_allclose(spread**2 - before**2, [weight * 0.1**2, 0.0], atol=1e-6)
        words = captured_words(replace(found(), answer=answer))
        assert f", 10.0 % of the scene's size away, with a chance of {100.0 * chance:.0f} %." in words
    assert "instead" not in captured_words(replace(found(), answer=replace(plain, rivals=(RivalLamps(beside, 0.01),))))


def test_a_given_number_is_not_asked() -> None:
    alone = capture_scene(photographs(LAMPS[:1]), blank_room(), replace(OPTIONS, count=1))
    assert len(alone.lamps) == 1
    assert "Their number was given" in captured_words(alone)
    assert float((alone.lamps[0].position - LAMPS[0].position).norm()) < 0.01


def test_light_that_lamps_and_paint_leave_unexplained_is_told() -> None:
    assert "unexplained" not in captured_words(found())
    best = found().answer.best
    field = replace(best.problem.field, variances=replace(best.problem.field.variances, noise=0.3**2))
    worse = replace(best, problem=replace(best.problem, field=field))
    words = captured_words(replace(found(), answer=replace(found().answer, best=worse)))
    assert "leave 30 % of a surface's light unexplained" in words


def test_a_black_patch_on_a_wall_is_dark() -> None:
    """A tenth of its wall, blurred by photographs of 40 pixels: it was taken for outliers on what is around it."""
    away = np.abs(painted_room().centers.double().numpy() - [0.036, -0.5, 0.036])
    patch = (away < [0.18, 1e-3, 0.18]).all(axis=1)
    views = pictures(radiance_under(LAMPS[:1], darker=np.where(patch, 0.1, 1.0)[:, None]))
    captured = capture_scene(views, blank_room(), replace(OPTIONS, count=1))
    albedo, true = captured.surfels.albedo[: len(patch)].numpy(), painted_room().albedo.numpy()
    reflected = np.median(albedo[patch] / true[patch])
    assert reflected < 0.3, reflected  # 0.23; 0.97 as outliers
