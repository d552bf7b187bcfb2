"""Frozen scenes judged on views that they rendered themselves, whole and with errors put in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from lit_room import VISIBLE, frozen_room, room_cameras
from rgspipe.datasets.views import View
from rgspipe.evaluation.error_split import KINDS
from rgspipe.evaluation.held_out import QUALITY
from rgspipe.evaluation.judgement import PLACES, Renders, kinds_of_views, render_views
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.scene.gloss import Gloss


@pytest.fixture(scope="module")
def frozen() -> FrozenScene:
    return frozen_room()


@pytest.fixture(scope="module")
def views(frozen: FrozenScene) -> list[View]:
    """Two views whose images the scene made itself, with light where pixels look."""
    light = PointLight(torch.tensor(VISIBLE, dtype=torch.float64), torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64))
    blank = [
        View(f"test/{k}", camera, torch.zeros(24, 24, 3), torch.ones(24, 24), light)
        for k, camera in enumerate(room_cameras(24))
    ]
    made = render_views(frozen, blank)
    pairs = zip(blank, made.images["pixels"], made.albedo, strict=True)
    return [
        replace(view, image=torch.from_numpy(image), albedo=torch.from_numpy(albedo)) for view, image, albedo in pairs
    ]


def test_a_scene_is_perfect_on_its_own_images_and_coarser_light_is_not(frozen: FrozenScene, views: list[View]) -> None:
    quality = render_views(frozen, views).quality().set_index("light")
    assert list(quality.columns) == list(QUALITY) and list(quality.index) == list(PLACES)
    assert quality.loc["pixels", "flip"] == 0.0 and quality.loc["pixels", "ssim"] == pytest.approx(1.0)
    assert 35.0 < quality.loc["centres", "psnr"] < 55.0  # measured 45.8
    assert (quality["albedo_l1"] == 0.0).all() and (quality["count"] == len(frozen.surfels)).all()
    assert quality["psnr_off_edges"].isna().all(), "these views have no passes"


def test_wrong_albedo_shows_in_images_and_in_albedo(frozen: FrozenScene, views: list[View]) -> None:
    darker = replace(frozen, surfels=replace(frozen.surfels, albedo=0.9 * frozen.surfels.albedo))
    row = render_views(darker, views).quality().iloc[0]
    assert row["albedo_l1"] == pytest.approx(0.1, abs=1e-5) and row["albedo_l1_scaled"] < 1e-5  # measured 6e-8
    assert row["psnr"] < 35.0  # measured 29.9


def test_views_without_passes_are_not_split(frozen: FrozenScene, views: list[View]) -> None:
    assert kinds_of_views(frozen, views) is None


def test_a_split_has_a_row_for_each_kind_and_place(frozen: FrozenScene, views: list[View]) -> None:
    renders = render_views(frozen, views)
    kinds = [np.arange(24 * 24).reshape(24, 24) % len(KINDS) for _ in views]
    split = renders.split(kinds)
    assert list(zip(split["light"], split["kind"], strict=True)) == [
        (place, kind) for place in PLACES for kind in KINDS
    ]
    centres = split[split["light"] == "centres"]
    assert centres["error"].sum() == pytest.approx(1.0) and (centres["pixels"] == 0.25).all()


def test_kinds_follow_the_passes_and_the_light(frozen: FrozenScene, views: list[View]) -> None:
    passes = torch.full((24, 24), 0.8), torch.tensor([0.0, 0.0, 1.0]).expand(24, 24, 3)
    kinds = kinds_of_views(frozen, [replace(view, depth=passes[0], normal=passes[1]) for view in views])
    assert len(kinds) == 2 and all(kind.shape == (24, 24) for kind in kinds)
    assert not any((kind == KINDS.index("edges")).any() for kind in kinds), "even depth has no edges"
    assert any((kind == KINDS.index("shadow_edges")).any() for kind in kinds)


def test_a_view_without_a_light_is_refused(frozen: FrozenScene, views: list[View]) -> None:
    with pytest.raises(ValueError, match="must have lights"):
        render_views(frozen, [replace(views[0], light=None)])


def test_the_table_of_a_place_names_its_views(frozen: FrozenScene, views: list[View]) -> None:
    renders = render_views(frozen, views)
    assert isinstance(renders, Renders) and renders.table("pixels")["name"].tolist() == ["test/0", "test/1"]


def test_a_glossy_scene_shows_its_highlights_wherever_light_is_taken(frozen: FrozenScene, views: list[View]) -> None:
    count = len(frozen.surfels)
    gloss = Gloss(torch.full((count, 3), 0.2), torch.full((count,), 10.0))
    surfels = replace(frozen.surfels, gloss=gloss)
    glossy = FrozenScene.freeze(surfels, gather_rays=64, patches=50, seed=0)
    renders = render_views(glossy, views[:1])
    expected = glossy.render(glossy.view(views[0].camera), (views[0].light,), sharp=False).numpy()
    assert np.abs(renders.images["centres"][0] - expected).max() < 1e-4 * expected.max()
    plain = render_views(replace(glossy, gloss=None), views[:1]).images["pixels"][0]
    assert renders.images["pixels"][0].mean() > 1.1 * plain.mean()
