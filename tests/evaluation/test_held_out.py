"""Tables and pictures of held-out views."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from raycast import BLOCK, ROOM, view_of
from rgspipe.datasets.views import View
from rgspipe.evaluation import held_out, metrics
from rgspipe.scene import Camera, look_at


@pytest.fixture(scope="module")
def views() -> list[View]:
    """Two views with all passes; the image is the albedo."""
    seen = [view_of([ROOM, BLOCK], (-0.4, y, 0.4), (0.1, 0.0, -0.3), 32, 1.4, normals=True) for y in (-0.4, 0.3)]
    return [replace(view, image=0.5 + 0.4 * view.normal, albedo=0.5 + 0.4 * view.normal) for view in seen]


def _plain_view(size: int) -> View:
    pose = look_at(torch.tensor([0.0, -2.0, 0.0]), torch.zeros(3))
    camera = Camera.from_field_of_view(pose, 1.0, size, size)
    return View("test/0", camera, torch.full((size, size, 3), 0.5), torch.ones(size, size))


def test_the_table_has_every_measure_of_every_view(views: list[View]) -> None:
    images = [view.image + 0.01 for view in views]
    table = held_out.view_table(images, views)
    assert table["name"].tolist() == [view.name for view in views]
    assert table["psnr"].tolist() == pytest.approx(
        [metrics.psnr(i, v.image) for i, v in zip(images, views, strict=True)]
    )
    assert np.isfinite(table[list(held_out.MEASURES)].to_numpy()).all()
    perfect = held_out.view_table([view.image for view in views], views)
    assert (perfect["flip"] == 0.0).all() and (perfect["ssim"] > 0.999999).all()


def test_errors_at_edges_do_not_count_off_edges(views: list[View]) -> None:
    edges = metrics.edge_mask(views[0].depth, views[0].normal)
    image = views[0].image.numpy().copy()
    image[edges] += 0.3
    row = held_out.view_table([image], views[:1]).iloc[0]
    assert row["psnr_off_edges"] == math.inf and row["psnr"] < 30.0
    on_surfaces, off_edges = held_out.albedo_of_views([image], views[:1])
    assert off_edges.relative_l1 == 0.0 < on_surfaces.relative_l1


def test_without_passes_there_are_no_figures_off_edges_and_none_of_albedo() -> None:
    view = _plain_view(16)
    table = held_out.view_table([view.image + 0.1], [view])
    summary = held_out.held_out_summary(table, *held_out.albedo_of_views([view.image], [view]))
    assert summary["test_psnr_off_edges_mean"] is None and summary["albedo"] is None
    assert summary["test_psnr_mean"] == pytest.approx(metrics.psnr(view.image + 0.1, view.image))
    assert held_out.surface_pixels(view).all()
    gaps = replace(view, depth=torch.full((16, 16), math.nan), normal=torch.zeros(16, 16, 3))
    assert held_out.plain_pixels(gaps) is None and not held_out.surface_pixels(gaps).any()


def test_a_black_view_has_no_psnr_and_takes_that_of_others_from_nobody(views: list[View]) -> None:
    # The mean was NaN: no figure in the report, and no grade that JSON could hold after a whole training.
    black = replace(views[1], image=torch.zeros_like(views[1].image))
    table = held_out.view_table([views[0].image + 0.01, black.image], [views[0], black])
    summary = held_out.held_out_summary(table, None, None)
    first = metrics.psnr(views[0].image + 0.01, views[0].image)
    assert [summary[f"test_psnr_{what}"] for what in ("mean", "median", "min")] == [pytest.approx(first)] * 3
    assert summary["per_view"][1]["psnr"] is None


def test_worst_is_the_lowest_similarity_and_the_largest_error(views: list[View]) -> None:
    table = held_out.view_table([views[0].image + 0.01, views[1].image + 0.1], views)
    summary = held_out.held_out_summary(table, *held_out.albedo_of_views([view.albedo for view in views], views))
    assert summary["test_psnr_min"] == table["psnr"].min() and summary["test_flip_max"] == table["flip"].max()
    # Perfect albedo has an infinite PSNR, which JSON does not know.
    assert summary["albedo"]["psnr"] is None and summary["albedo"]["relative_l1"] == 0.0
    assert [row["name"] for row in summary["per_view"]] == table["name"].tolist()
    json.dumps(summary, allow_nan=False)


@pytest.mark.parametrize("count", [1, 2, 5, 24])
def test_the_picture_shows_a_few_views_whatever_their_number(count: int) -> None:
    views, images = [_plain_view(8)] * count, [np.full((8, 8, 3), 0.4)] * count
    height, width, _ = held_out.held_out_picture(views, images, np.linspace(20.0, 40.0, count)).shape
    shown = min(count, held_out.SHOWN_VIEWS)
    columns = 2 if shown % 2 == 0 else 1
    assert width >= columns * 3 * 8 and height >= (shown // columns) * 8


def test_the_picture_goes_from_the_worst_to_the_best_and_shows_albedo(views: list[View]) -> None:
    renders = [0.0 * view.image for view in views]
    shown = held_out.held_out_picture(views, renders, [40.0, 20.0], [view.albedo for view in views])
    swapped = held_out.held_out_picture(views, renders, [20.0, 40.0], [view.albedo for view in views])
    assert shown.shape[1] >= 6 * 32 and shown.shape[0] >= 2 * 32
    assert (shown[:32] == swapped[-32:]).all() and not (shown == swapped).all()
    # Its own albedo: true and rendered are alike, their difference is white.
    left = 3 * 32 + 2 * 4 + held_out.COLUMN_GAP
    assert (shown[:32, left : left + 32] == shown[:32, left + 36 : left + 68]).all()
