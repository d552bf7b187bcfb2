"""Pixels are told apart by the true scene, and the parts of the error sum up to the whole."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from raycast import BLOCK, ROOM, cast, view_of
from rgspipe.datasets.views import View
from rgspipe.evaluation import error_split, metrics
from rgspipe.evaluation.error_split import KINDS, pixel_kinds, split_error
from rgspipe.scene import PointLight

LIGHT = (0.2, -0.15, -0.4)


@pytest.fixture(scope="module")
def view() -> View:
    """A block in a closed room, 64², with a light near the floor."""
    seen = view_of([ROOM, BLOCK], (-0.4, -0.45, 0.4), (0.1, 0.0, -0.3), 64, 1.4, normals=True)
    return replace(seen, light=PointLight(torch.tensor(LIGHT, dtype=torch.float64), torch.ones(3)))


def _points(view: View) -> np.ndarray:
    """(H, W, 3) what each pixel's centre sees."""
    origins, directions, lengths = (part.numpy() for part in view.camera.rays())
    return (origins + directions * (lengths * view.depth.double().numpy().ravel())[:, None]).reshape(64, 64, 3)


def _lit(view: View) -> np.ndarray:
    """(H, W) 1 where the light reaches, 0 where the block is in between."""
    points = _points(view).reshape(-1, 3)
    away = points - np.array(LIGHT)
    distance = np.linalg.norm(away, axis=1)
    blocked = cast([BLOCK], np.array(LIGHT), away / distance[:, None])[0] < distance - 1e-4
    return 1.0 - blocked.reshape(64, 64)


def test_every_kind_of_pixel_is_where_it_should_be(view: View) -> None:
    lit = _lit(view)
    kinds = pixel_kinds(view, lit, scene_size=1.0)
    assert {KINDS[index] for index in np.unique(kinds)} == set(KINDS)
    edges = metrics.edge_mask(view.depth, view.normal)
    assert ((kinds == 0) == edges).all()
    step = np.zeros_like(edges)
    step[:, 1:] |= lit[:, 1:] != lit[:, :-1]
    step[1:] |= lit[1:] != lit[:-1]
    assert (kinds[step & ~edges] == KINDS.index("shadow_edges")).all() and (step & ~edges).sum() > 20
    distance = np.linalg.norm(_points(view) - np.array(LIGHT), axis=-1)
    near = kinds == KINDS.index("near_light")
    assert near.any() and (distance[near] < error_split.NEAR_LIGHT).all()
    assert (distance[kinds == KINDS.index("rest")] >= error_split.NEAR_LIGHT).all()


def test_even_light_and_unknown_light_have_no_shadow_edges(view: View) -> None:
    for transmittance in (np.full((64, 64), 0.4), np.full((64, 64), np.nan)):
        assert not (pixel_kinds(view, transmittance, 1.0) == KINDS.index("shadow_edges")).any()
    half = np.where(np.arange(64) < 32, 1.0, np.nan)[None].repeat(64, axis=0)
    assert not (pixel_kinds(view, half, 1.0) == KINDS.index("shadow_edges")).any()


def test_the_larger_the_scene_the_more_is_near_the_light(view: View) -> None:
    lit = np.ones((64, 64))
    counts = [(pixel_kinds(view, lit, size) == KINDS.index("near_light")).sum() for size in (0.5, 1.0, 2.0)]
    assert counts[0] < counts[1] < counts[2]


def test_the_parts_sum_up_to_the_whole_error() -> None:
    generator = np.random.default_rng(0)
    targets = [generator.uniform(0.0, scale, (8, 8, 3)) for scale in (1.0, 50.0)]
    images = [target + generator.normal(0.0, 0.1, target.shape) for target in targets]
    kinds = [generator.integers(0, 4, (8, 8)) for _ in targets]
    split = split_error(images, targets, kinds)
    whole = np.mean([10.0 ** (-0.1 * metrics.psnr(i, t)) for i, t in zip(images, targets, strict=True)])
    assert split.error.sum() == pytest.approx(whole, rel=1e-12)
    assert split.pixels.sum() == pytest.approx(1.0)
    table = split.table().set_index("kind")
    assert table["error"].sum() == pytest.approx(1.0)


def test_an_error_in_one_kind_only_is_found_there() -> None:
    target, kinds = np.ones((8, 8, 3)), np.full((8, 8), KINDS.index("rest"))
    kinds[:2] = KINDS.index("edges")
    image = target.copy()
    image[:2] += 0.1
    table = split_error([image], [target], [kinds]).table().set_index("kind")
    assert table.loc["edges", ["pixels", "error", "psnr"]].tolist() == pytest.approx([0.25, 1.0, 20.0])
    assert table.loc["rest", "psnr"] == np.inf and np.isnan(table.loc["near_light", "psnr"])


def test_black_views_do_not_count_and_only_black_views_are_refused() -> None:
    target, kinds = np.ones((4, 4, 3)), np.zeros((4, 4), dtype=int)
    both = split_error([target + 0.1, target], [target, 0 * target], [kinds, kinds])
    assert both.error[0] == pytest.approx(0.01)
    with pytest.raises(ValueError, match="brighter than black"):
        split_error([target], [0 * target], [kinds])


def test_what_is_needed_is_said(view: View) -> None:
    with pytest.raises(ValueError, match="lacks"):
        pixel_kinds(replace(view, normal=None), np.ones((64, 64)), 1.0)
    with pytest.raises(ValueError, match="shape"):
        pixel_kinds(view, np.ones((8, 8)), 1.0)
