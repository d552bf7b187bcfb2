"""Which gather operator is worth its time: error and light bias against the number of rays, for ways to make it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.benchmark.form_factors import unoccluded_form_factors, with_sampled_visibility
from rgspipe.benchmark.rooms import Room
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import prepare_views
from rgspipe.fitting.search_lm import fit_from
from rgspipe.progress import progress_bar
from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.point_sets import PointSet
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import build_patch_transport
from rgspipe.renderer.view_weights import ViewWeights, build_view_weights
from rgspipe.scene import PointLight
from rgspipe.scene.surfels import Surfels

#: Numbers of rays that are compared.
RAYS = (32, 64, 128, 256, 512)

#: Patches of the sampled visibility.
PATCHES = 500

#: Lights at least this far from any surface count as in the open, scene units.
IN_THE_OPEN = 0.1

#: Distances of the lights whose spots are gathered, from the surfels that they light, and how many of each.
SPOT_DISTANCES, SPOTS = (0.05, 0.1), 4


@dataclass(frozen=True)
class GatherVariant:
    """A way to make a gather operator.

    Attributes:
        points: how rays are placed.
        reciprocal: whether it is averaged with its reciprocal.
        analytic: whether form factors in closed form take the place of the sampled ones, with their visibility.
    """

    points: PointSet
    reciprocal: bool
    analytic: bool = False


VARIANTS = (
    *(GatherVariant(points, reciprocal) for points in ("random", "jittered", "r2", "sobol", "golden")
      for reciprocal in (False, True)),
    *(GatherVariant("golden", reciprocal, analytic=True) for reciprocal in (False, True)),
)  # fmt: skip


@dataclass(frozen=True)
class _Bench:
    """What all variants of one room share."""

    room: Room
    bvh: SurfelBvh
    areas: Tensor
    views: tuple[ViewWeights, ...]

    @cached_property
    def labels(self) -> np.ndarray:
        return cluster_patches(self.bvh.surfels.centers, self.bvh.surfels.normals, PATCHES, seed=0)

    def gather(self, variant: GatherVariant, rays: int, seed: int) -> SparseOperator:
        areas = self.areas if variant.reciprocal else None
        sampled = build_gather(self.bvh, rays, seed=seed, areas=areas, points=variant.points)
        if not variant.analytic:
            return sampled
        factors = unoccluded_form_factors(self.bvh.surfels, self.areas)
        labels = torch.from_numpy(self.labels).long()
        dense = with_sampled_visibility(factors, sampled.matrix.to_dense(), labels)
        return SparseOperator.from_scipy(scipy.sparse.csr_matrix(dense.numpy()))

    def scene(self, gather: SparseOperator) -> FrozenScene:
        """The room with the full solve through `gather`; one patch stands where it is not used."""
        surfels = self.bvh.surfels
        one = np.zeros(len(surfels), dtype=np.int32)
        transport = build_patch_transport(gather, one, self.areas, surfels.albedo)
        return FrozenScene(surfels, self.areas, gather, transport).with_solver("gather")


def compare_gathers(
    room: Room,
    surfels: Surfels,
    *,
    rays: Sequence[int] = RAYS,
    variants: Sequence[GatherVariant] = VARIANTS,
    reference_rays: int = 8192,
    resolution: int = 48,
    seed: int = 0,
) -> pd.DataFrame:
    """One row per variant and number of rays, measured against a gather of `reference_rays` rays of another seed.

    Columns:
        points, reciprocal, analytic, rays: the variant.
        build_cpu_s: processor time of all threads; entries, mib: what is stored.
        smooth_error, spot_0.05_error, spot_0.1_error: root mean square of F B − F_ref B over that of F_ref B, for
            a radiance that changes slowly, and for direct light from lights so near to a surface.
        open_bias, near_bias: position error over the room's size of fits that start at the true light, with the
            reference's image for a target, for the room's lights at least 0.1 from its surfaces, and nearer ones;
            the largest. `open_bias_median`, `near_bias_median`: the medians.

    Args:
        surfels: of the room; a few thousand if analytic variants are among those compared.
        reference_rays: of Sobol's points, with reciprocity.
        resolution: of the room's cameras.
    """
    bvh = SurfelBvh(surfels.to(torch.float32))
    views = tuple(build_view_weights(bvh, camera) for camera in room.cameras(resolution))
    bench = _Bench(room, bvh, surfel_areas(bvh, samples=256, seed=seed), views)
    reference = bench.gather(GatherVariant("sobol", reciprocal=True), reference_rays, seed + 1)
    sources = _sources(bench, seed)
    exact = {name: reference @ source for name, source in sources.items()}
    targets = _targets(bench, bench.scene(reference))
    rows = []
    for variant, count in progress_bar([(v, m) for v in variants for m in rays], "gather operators", unit="operator"):
        begin = time.process_time()
        gather = bench.gather(variant, count, seed + 2)
        seconds = time.process_time() - begin
        row = vars(variant) | {"rays": count, "build_cpu_s": seconds, "entries": gather.entries}
        row["mib"] = 8 * gather.entries / 2**20
        for name, source in sources.items():
            row[f"{name}_error"] = float(((gather @ source) - exact[name]).norm() / exact[name].norm())
        rows.append(row | _biases(bench, gather, targets))
    return pd.DataFrame(rows)


def _sources(bench: _Bench, seed: int) -> dict[str, Tensor]:
    """Radiances (N, K) to gather, by name."""
    surfels = bench.bvh.surfels
    phase = 2.0 * torch.pi * (surfels.centers.float() - surfels.centers.float().mean(dim=0))
    result = {"smooth": 1.0 + 0.5 * phase.sin()}
    for distance in SPOT_DISTANCES:
        lights = _lights_near(surfels, distance, seed)
        result[f"spot_{distance}"] = unit_irradiance(bench.bvh, lights)[0].T
    return result


def _lights_near(surfels: Surfels, distance: float, seed: int) -> Tensor:
    """(SPOTS, 3) places over surfels that are nearest to them."""
    order = torch.randperm(len(surfels), generator=torch.Generator().manual_seed(seed))
    centers, normals = surfels.centers.float(), surfels.normals.float()
    places = centers[order] + distance * normals[order]
    nearest = torch.cat([torch.cdist(part, centers).amin(dim=1) for part in places.split(1000)])
    return places[nearest > 0.99 * distance][:SPOTS]


def _targets(bench: _Bench, scene: FrozenScene) -> list[list[Tensor]]:
    """The reference's images of each of the room's lights."""
    rigs = [bench.room.rig(light) for light in range(len(bench.room.lights))]
    return [[scene.render(view, rig, sharp=False) for view in bench.views] for rig in rigs]


def _biases(bench: _Bench, gather: SparseOperator, targets: list[list[Tensor]]) -> dict[str, float]:
    scene = bench.scene(gather)
    prepared = prepare_views(scene, bench.views)
    errors: dict[str, list[float]] = {"open": [], "near": []}
    for light, images in enumerate(targets):
        truth = bench.room.lights[light].double()
        problem = LightProblem.create(prepared, prepared.stack_images(images))
        found = fit_from(problem, [Emitter(PointLight(truth, 1.0))]).lights[0].position
        kind = "open" if bench.room.clearance(light) >= IN_THE_OPEN else "near"
        errors[kind].append(float((found - truth).norm()) / scene.size)
    largest = {f"{kind}_bias": max(found, default=float("nan")) for kind, found in errors.items()}
    return largest | {f"{kind}_bias_median": float(np.median(found)) for kind, found in errors.items() if found}
