"""What is known of surfaces that no camera saw before an image is looked at: which belong together, and their doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.scene.spacing import surfel_spacing
from rgspipe.scene.surfels import Surfels

#: Surfels no farther apart than so many of their distances, and turned by less than 45°, are of one surface.
TOGETHER, TURNED = 2.0, 0.7

#: Surfaces that are doubted on their own, the largest; all others are doubted together, as none of them does much.
MOST = 15

#: Cosine of the turns within which surfels are of one plane, and of how much of a bent surface's normals is left.
FLAT = 0.9

#: Seen surfels in the plane of a guessed surface, over its own, from which on they tell what it is like.
KIN = 0.1

#: No guess is better than this: in white rooms whose walls are all alike, guesses were 0.05 to 0.06 off.
LEAST_DOUBT = 0.05


def spread_of_albedo(surfels: Surfels) -> Tensor:
    """() standard deviation of the logarithm of the albedo of all surfels that cameras saw: a guess has no other."""
    return _spread(surfels.albedo[surfels.guessed == 0.0])


def _spread(albedo: Tensor) -> Tensor:
    """() standard deviation of the logarithm of albedo (K, 3), at least LEAST_DOUBT."""
    grey = albedo.mean(dim=1).clamp(min=1e-3)
    return grey.log().std(correction=0).clamp(min=LEAST_DOUBT) if len(grey) else grey.new_tensor(LEAST_DOUBT)


def guessed_surfaces(surfels: Surfels) -> Tensor:
    """(S, N) of the surfels' type: 1 where a surfel is of a guessed surface, of S ≤ MOST + 1."""
    labels = labels_of_guesses(surfels)
    own = (labels >= 0).nonzero()[:, 0]
    marks = surfels.centers.new_zeros((0, len(surfels)))
    if not len(own):
        return marks
    labels = labels[own].cpu()
    # The largest first; a stable order, so that equal ones do not depend on the machine.
    order = torch.bincount(labels).argsort(descending=True, stable=True)
    rank = torch.empty_like(order)
    rank[order] = torch.arange(len(order))
    chosen = rank[labels].clamp(max=MOST).to(own.device)
    marks = surfels.centers.new_zeros((int(chosen.max()) + 1, len(surfels)))
    marks[chosen, own] = 1.0
    return marks


def labels_of_guesses(surfels: Surfels) -> Tensor:
    """(N,) int64 number of the guessed surface that a surfel belongs to; −1 for those that cameras saw."""
    own = (surfels.guessed > 0.0).nonzero()[:, 0]
    labels = torch.full((len(surfels),), -1, device=own.device)
    if len(own):
        found = _together(surfels.centers[own].double().cpu(), surfels.normals[own].double().cpu(), _spacing(surfels))
        labels[own] = found.to(own.device)
    return labels


@dataclass(frozen=True)
class GuessedSurfaces:
    """The surfaces that no camera saw, and those that were seen which they go on from.

    Attributes:
        labels: (N,) int64, as of `labels_of_guesses`.
        kin: for each of the surfaces the surfels (K,) int64 that cameras saw in its plane; where fewer are seen than
            KIN of what is guessed, those of the thing's other sides that it touches. None where it is bent: guesses on
            two things that are sunk into each other may be one bent surface.
        in_plane: for each of them which it is.
        edges: (E, 2) int64 surfels that cameras saw on both sides of edges of things.
    """

    labels: Tensor
    kin: tuple[Tensor, ...]
    in_plane: tuple[bool, ...]
    edges: Tensor

    @classmethod
    def of(cls, surfels: Surfels) -> GuessedSurfaces:
        """Those of surfels that know which of them are guessed."""
        labels = labels_of_guesses(surfels)
        centers, normals, spacing = surfels.centers.double(), surfels.normals.double(), _spacing(surfels)
        seen, kin, in_plane = surfels.guessed == 0.0, [], []
        convex = _edges_of_things(centers, normals, spacing)
        near = torch.cat([convex, convex.flip(1)])
        for label in range(int(labels.max()) + 1):
            own = labels == label
            normal = normals[own].mean(dim=0)
            flat, normal = float(normal.norm()) > FLAT, normal / normal.norm().clamp(min=1e-12)
            height = (centers - centers[own].mean(dim=0)) @ normal
            alike = seen & (height.abs() <= spacing) & (normals @ normal > FLAT)
            enough = flat and int(alike.sum()) >= KIN * int(own.sum())
            sides = near[own[near[:, 0]] & seen[near[:, 1]], 1].unique()
            kin.append(alike.nonzero()[:, 0] if enough else sides if flat else labels[:0])
            in_plane.append(enough)
        return cls(labels, tuple(kin), tuple(in_plane), convex[seen[convex].all(dim=1)])

    def expected(self, albedo: Tensor) -> tuple[Tensor, Tensor]:
        """(N, 3) albedo that guessed surfels should have if others have `albedo` (N, 3), the median of their kin, and
        (N, 1) how much its logarithm is in doubt: in a plane as much as among these, and on another side of a thing as
        much as sides of things differ that were seen. NaN where there are none, and where seen."""
        found = torch.full_like(albedo, torch.nan)
        doubt = torch.full_like(albedo[:, :1], torch.nan)
        for label, (kin, in_plane) in enumerate(zip(self.kin, self.in_plane, strict=True)):
            if len(kin) and (in_plane or len(self.edges)):
                own = self.labels == label
                found[own] = albedo[kin].median(dim=0).values
                doubt[own] = _spread(albedo[kin]) if in_plane else self._across_edges(albedo)
        return found, doubt

    def _across_edges(self, albedo: Tensor) -> Tensor:
        """() root mean square of what the logarithm of albedo (N, 3) differs by from side to side of seen things."""
        grey = albedo.mean(dim=1).clamp(min=1e-3).log()[self.edges]
        return (grey[:, 0] - grey[:, 1]).square().mean().sqrt().clamp(min=LEAST_DOUBT)


def doubts_of_guesses(surfels: Surfels) -> Tensor:
    """(N,) how much the logarithm of the albedo of guessed surfels is in doubt; 0 for those that cameras saw.

    Of surfaces that go on in the plane of others it is the spread of these, else that of all that was seen: that sides
    of things are alike is expected, but that the one which nobody saw is like them no image tells.
    """
    surfaces = GuessedSurfaces.of(surfels)
    _, doubt = surfaces.expected(surfels.albedo)
    labels = surfaces.labels
    planes = torch.tensor([*surfaces.in_plane, False], device=labels.device)[labels]
    doubt = torch.where(planes, doubt[:, 0], spread_of_albedo(surfels))
    return torch.where(surfels.guessed > 0.0, doubt, 0.0)


def _spacing(surfels: Surfels) -> float:
    """Distance of neighbours; 0 where no two are of one surface."""
    try:
        return surfel_spacing(surfels.centers.cpu(), surfels.normals.cpu())
    except ValueError:
        return 0.0


def _edges_of_things(centers: Tensor, normals: Tensor, spacing: float) -> Tensor:
    """(Q, 2) int64 pairs of near surfels of two sides of a thing: each is behind the plane of the other."""
    pairs = torch.from_numpy(cKDTree(centers.cpu().numpy()).query_pairs(TOGETHER * spacing, output_type="ndarray"))
    pairs = pairs.to(centers.device)
    first, second = pairs.T
    away, cosine = centers[second] - centers[first], (normals[first] * normals[second]).sum(dim=1)
    behind = ((away * normals[first]).sum(dim=1) < 0.0) & ((away * normals[second]).sum(dim=1) > 0.0)
    return pairs[(cosine.abs() <= TURNED) & behind]


def _together(centers: Tensor, normals: Tensor, spacing: float) -> Tensor:
    """(G,) int64 label of the surface that each of G surfels belongs to."""
    pairs = torch.from_numpy(cKDTree(centers.numpy()).query_pairs(TOGETHER * spacing, output_type="ndarray"))
    first, second = pairs[(normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(dim=1) > TURNED].T.numpy()
    count = len(centers)
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    return torch.from_numpy(connected_components(graph, directed=False)[1]).long()
