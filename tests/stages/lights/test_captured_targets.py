"""fit_light on targets as cameras take them: PNG images, masks, unknown exposure, and errors put in for studies."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from frozen_store import RESOLUTION, frozen_artifact, write_display_target
from lit_room import VISIBLE, room_cameras
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews, ImageCapture
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights import fit_light
from rgspipe.stages.lights.capture import captured_views
from rgspipe.store.artifacts import Artifact

LIGHT = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64))


@pytest.fixture(scope="module")
def freeze(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return frozen_artifact(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def images(freeze: Artifact) -> list[torch.Tensor]:
    """Two views of LIGHT, of which 5 % of the values are above 1."""
    views = FitViews.prepare(FrozenScene.load(freeze.folder()), room_cameras(RESOLUTION), sharp=True)
    images = views.render(LIGHT)
    white = float(torch.cat([image.reshape(-1) for image in images]).quantile(0.95))
    return [image / white for image in images]


def _config(**changes: object) -> RgspipeConfig:
    named = {key.replace("__", "."): value for key, value in changes.items()}
    return with_changes(RgspipeConfig(stage="fit_light"), {"views.count": 2} | named)


def _fitted(freeze: Artifact, folder: Path, target: Path, **changes: object) -> tuple[PointLight, dict]:
    folder.mkdir()
    fit_light.run(StageContext(_config(fit__target=str(target), **changes), {"freeze": freeze}, {}, folder))
    file = folder / target.name / "lights.json"
    return read_lights(file)[0], json.loads(file.read_text())


def _error(light: PointLight) -> float:
    return float((light.position - LIGHT.position).norm())


def test_png_targets_are_fitted_as_clipped_images(freeze: Artifact, images: list[torch.Tensor], tmp_path: Path) -> None:
    write_display_target(tmp_path / "png", images)
    light, content = _fitted(freeze, tmp_path / "out", tmp_path / "png")
    assert _error(light) < 2e-3 and content["result"] == "converged"
    _, capture = captured_views(load_target(tmp_path / "png").views, "png", _config())
    assert capture.clip == 1.0


def test_jpeg_targets_are_fitted_as_clipped_images_that_were_blurred(
    freeze: Artifact, images: list[torch.Tensor], tmp_path: Path
) -> None:
    write_display_target(tmp_path / "jpeg", [1.5 * image for image in images], suffix=".jpg")
    light, _ = _fitted(freeze, tmp_path / "out", tmp_path / "jpeg")
    views = load_target(tmp_path / "jpeg").views
    _, capture = captured_views(views, "jpeg", _config())
    assert capture.clip == 1.0 and capture.saturated == views[0].saturated_from < 0.85
    frozen = FrozenScene.load(freeze.folder())
    prepared = FitViews.prepare(frozen, room_cameras(RESOLUTION))
    naive = prepared.fit([view.image for view in views], capture=ImageCapture(clip=1.0)).lights[0]
    # Measured: 0.0059 of a room of side 1, and 0.17 where the brightest level alone counts as saturated.
    assert _error(light) < 1e-2 and _error(naive) > 5.0 * _error(light)


def test_alpha_masks_what_is_not_the_scene(
    freeze: Artifact, images: list[torch.Tensor], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A third of each image is someone else's, and its alpha 0; masks that are the wrong way round are told."""
    spoilt, alphas = [image.clone() for image in images], [torch.ones(RESOLUTION, RESOLUTION) for _ in images]
    for image, alpha in zip(spoilt, alphas, strict=True):
        image[:, : RESOLUTION // 3] = torch.rand(3)
        alpha[:, : RESOLUTION // 3] = 0.0
    write_display_target(tmp_path / "masked", spoilt, alphas)
    light, _ = _fitted(freeze, tmp_path / "out", tmp_path / "masked")
    assert _error(light) < 3e-3
    assert "masks" not in capsys.readouterr().out
    write_display_target(tmp_path / "inverted", images, [1.0 - alpha for alpha in alphas])
    _fitted(freeze, tmp_path / "again", tmp_path / "inverted")
    assert "target inverted: masks or alpha leave out 69 %" in capsys.readouterr().out  # 22 of 32 columns


def test_views_of_unknown_exposure(freeze: Artifact, images: list[torch.Tensor], tmp_path: Path) -> None:
    write_display_target(tmp_path / "exposed", [0.5 * images[0], 0.2 * images[1]])
    light, content = _fitted(freeze, tmp_path / "out", tmp_path / "exposed", fit__exposure="free")
    assert _error(light) < 2e-3 and content["exposures"][1] == pytest.approx(0.4, rel=0.02)


def _stating(exposures: list[float], bases: list[float] | None = None) -> list[View]:
    """Grey views whose files state exposures, and bases that do."""
    grey, alpha = torch.full((RESOLUTION, RESOLUTION, 3), 0.3), torch.ones(RESOLUTION, RESOLUTION)
    views = [
        View(f"v{index}", camera, grey, alpha, exposure=exposure)
        for index, (camera, exposure) in enumerate(zip(room_cameras(RESOLUTION), exposures, strict=True))
    ]
    if bases is None:
        return views
    return [replace(view, base=0.5 * grey, base_exposure=base) for view, base in zip(views, bases, strict=True)]


def test_views_that_state_other_exposures_are_refused_where_these_are_known() -> None:
    captured_views(_stating([1.0, 1.03]), "a", _config())
    with pytest.raises(InputError, match=r"target a: .*v1 exposed 4 times as much as v0.*Set fit\.exposure=free"):
        captured_views(_stating([1.0, 4.0]), "a", _config())
    assert captured_views(_stating([1.0, 4.0]), "a", _config(fit__exposure="free"))[1].exposure_free


def test_a_base_that_states_another_exposure_than_its_view_is_refused_where_its_factor_is_known() -> None:
    captured_views(_stating([1.0, 4.0], [1.0, 4.0]), "a", _config(fit__exposure="free"))
    for exposures, exposure in (([1.0, 1.0], "known"), ([1.0, 4.0], "free")):
        with pytest.raises(InputError, match=r"v0 with the lamps off exposed 4 times as much as v0.*fit\.base_scale"):
            captured_views(_stating(exposures, [4.0, 4.0]), "a", _config(fit__exposure=exposure))
    captured_views(_stating([1.0, 1.0], [4.0, 4.0]), "a", _config(fit__base_scale="free"))
    with pytest.raises(InputError, match=r"v1 with the lamps off exposed 2 times as much as v0 with the lamps off"):
        captured_views(_stating([1.0, 1.0], [2.0, 4.0]), "a", _config(fit__base_scale="free"))


def test_radiance_is_not_clipped_and_a_stated_clip_counts(images: list[torch.Tensor]) -> None:
    views = [
        View(f"v{k}", c, i, torch.ones(i.shape[:2]))
        for k, (c, i) in enumerate(zip(room_cameras(RESOLUTION), images, strict=True))
    ]
    assert captured_views(views, "a", _config())[1].clip is None
    assert captured_views(views, "a", _config(fit__clip=0.8))[1].clip == 0.8
    noisy, capture = captured_views(views, "a", _config(target_capture__noise=0.05, target_capture__white=0.9))
    assert capture.clip is not None and float(noisy[0].image.max()) <= capture.clip * (1 + 1e-6)
    with pytest.raises(InputError, match=r"fit\.exposure"):
        captured_views(views, "a", _config(fit__method="paper_adam", fit__exposure="free"))


def test_each_view_is_clipped_where_it_is(freeze: Artifact, images: list[torch.Tensor]) -> None:
    """Of a view that is not, no value is doubted, however bright; of the others those that are saturated."""
    cameras, limits = room_cameras(RESOLUTION), [float(images[0].quantile(0.8)), None]
    views = [
        View(
            f"v{k}",
            camera,
            image if limit is None else image.clamp(max=limit),
            torch.ones(image.shape[:2]),
            saturated_from=limit,
        )
        for k, (camera, image, limit) in enumerate(zip(cameras, images, limits, strict=True))
    ]
    _, capture = captured_views(views, "a", _config())
    assert capture.clip == [limits[0], math.inf]
    seen = FitViews.prepare(FrozenScene.load(freeze.folder()), cameras, sharp=True)
    pixels = [view.image for view in views]
    problem = seen.problem(seen.prepared.stack_images(pixels), capture)
    first = seen.prepared.view_of == 0
    assert problem.saturated[first].any() and not problem.saturated[~first].any()
    found, naive = seen.fit(pixels, capture=capture, emitters=None), seen.fit(pixels, emitters=None)
    assert _error(found.lights[0]) < 1e-4  # measured 3e-8
    assert _error(naive.lights[0]) > 0.01  # measured 0.08
    with pytest.raises(InputError, match="clip: expected one number, or 2"):
        seen.fit(pixels, capture=ImageCapture(clip=[1.0, 1.0, 1.0]))


def test_a_frozen_scene_with_a_missing_object_has_fewer_surfels(freeze: Artifact, tmp_path: Path) -> None:
    box = [-0.15, -0.15, -0.4, 0.25, 0.25, 0.0]
    wrong = frozen_artifact(tmp_path, model_error__missing=box, model_error__albedo=0.1)
    counts = [len(FrozenScene.load(artifact.folder()).surfels) for artifact in (freeze, wrong)]
    assert counts[1] < counts[0]
