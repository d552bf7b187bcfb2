"""The rays that Embree is given are ours, and rates are what they say."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.sparse
import torch

from benchmark.test_mitsuba_peer import needs_mitsuba
from rgspipe.benchmark import ray_rate
from rgspipe.benchmark.mitsuba_process import PeerMissing, ask_mitsuba
from rgspipe.benchmark.ray_rate import footprint_quads, memory_traffic, ray_rates, shadow_rays
from rgspipe.benchmark.rooms import ROOMS
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.rectangles import rectangle, surfels_on
from rgspipe.scene.surfels import Surfels


def _surfels() -> Surfels:
    return surfels_on(rectangle([0, 0, 0], [2, 0, 0], [0, 1, 0], [0.5, 0.5, 0.5]), 50)


def test_quads_reach_to_where_opacity_ends() -> None:
    surfels = _surfels()
    offsets = footprint_quads(surfels) - surfels.centers[:, None]
    u = torch.einsum("nkc,nc->nk", offsets, surfels.frames[:, 0]) / surfels.scales[:, :1]
    v = torch.einsum("nkc,nc->nk", offsets, surfels.frames[:, 1]) / surfels.scales[:, 1:]
    for along in (u, v):
        opacity = surfels.opacities[:, None] * torch.exp(-0.5 * along.square())
        torch.testing.assert_close(opacity, torch.full_like(opacity, surfels.coverage.minimum_alpha))
    quads = footprint_quads(surfels)
    normals = torch.linalg.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 1])
    assert ((normals * surfels.normals).sum(dim=1) > 0).all()


def test_shadow_rays_lead_from_lit_faces_to_the_lights() -> None:
    surfels = _surfels()
    lights = torch.tensor([[0.3, 0.2, 0.7], [0.3, 0.2, -0.7], [1.0, 0.5, 0.4]], dtype=torch.float64)
    origins, paths = shadow_rays(surfels, lights)
    count = len(surfels)
    assert len(origins) == len(paths) == 2 * count, "the second light is behind every surfel"
    ends = origins + paths
    torch.testing.assert_close(ends, lights[[0, 2]].repeat_interleave(count, dim=0))
    away = (origins - surfels.centers.repeat(2, 1)).norm(dim=1)
    torch.testing.assert_close(away, 1.5 * surfels.scales.prod(dim=1).sqrt().repeat(2))


def test_without_the_peer_our_rates_stand_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object, **__: object) -> None:
        raise PeerMissing("not here")

    monkeypatch.setattr(ray_rate, "ask_mitsuba", missing)
    room = ROOMS["cornell"]()
    table = ray_rates(surfels_on(room.surfaces, 500), room.lights, room.cameras(8)[0], 2)
    ours, theirs = table[table["caster"] == "rgspipe"], table[table["caster"] != "rgspipe"]
    assert list(ours["count"]) == list(theirs["count"]) and (ours["mrays_per_s"] > 0).all()
    assert ours["mrays_per_s"].to_numpy() == pytest.approx(1e-3 * ours["count"].to_numpy() / ours["ms"].to_numpy())
    assert theirs["ms"].isna().all() and (theirs["note"] == "not here").all()


@pytest.mark.slow
@needs_mitsuba
def test_embree_meets_the_quads_it_is_given() -> None:
    quads = footprint_quads(_surfels()).numpy()
    origins = np.array([[0.5, 0.5, 1.0], [0.5, 0.5, 1.0], [9.0, 0.5, 1.0], [0.5, 0.5, 1.0]])
    paths = np.array([[0.0, 0.0, -2.0], [0.0, 0.0, -0.9], [0.0, 0.0, -2.0], [0.0, 0.0, 2.0]])
    rays = {"nearest_origins": origins, "nearest_directions": paths / np.linalg.norm(paths, axis=1, keepdims=True)}
    arrays = {"quads": quads, "occluded_origins": origins, "occluded_paths": paths, **rays}
    figures, _ = ask_mitsuba("rays", arrays, repetitions=2)
    assert figures["occluded_share"] == 0.25
    assert figures["occluded_ms"] > 0 and figures["nearest_ms"] > 0


def test_a_product_s_traffic_is_its_entries_operand_and_result() -> None:
    matrix = scipy.sparse.random(2000, 1000, 0.05, format="csr", dtype=np.float32, random_state=1)
    table = memory_traffic({"product": SparseOperator.from_scipy(matrix)}, 3, 2)
    copy, product = table.to_dict("records")
    assert product["bytes"] == 8 * matrix.nnz + 4 * 3 * (2000 + 1000)
    assert copy["floor_ms"] == pytest.approx(copy["ms"])
    assert product["gib_per_s"] == pytest.approx(product["bytes"] / 2**30 / (1e-3 * product["ms"]))
    assert product["floor_ms"] == pytest.approx(product["bytes"] / copy["bytes"] * copy["ms"])
    assert all(math.isfinite(row["gib_per_s"]) for row in (copy, product))
