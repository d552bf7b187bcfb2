"""What is known of surfaces that no camera saw before an image is looked at: which belong together, and their doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from rgspipe.scene.smooth_ways import TOGETHER, TURNED, SmoothWays
from rgspipe.scene.spacing import surfel_spacing
from rgspipe.scene.surfels import Surfels

#: Surfaces that are doubted on their own, the largest; all others are doubted together, as none of them does much.
MOST = 15

#: Cosine of the turns within which surfels are of one plane, and of how much of a bent surface's normals is left.
FLAT = 0.9

#: Seen surfels in the plane of a guessed surface, over its own, from which on they tell what it is like.
KIN = 0.1

#: What tells a guessed surface's albedo.
PLANE, BENT, SIDES = "plane", "bent", "sides"

#: Degrees of freedom of Student's t, as in captures, and rounds by which its scale is found.
FREEDOM, ROUNDS = 4.0, 30

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
    return GuessedSurfaces.of(surfels).labels


@dataclass(frozen=True)
class GuessedSurfaces:
    """The surfaces that no camera saw, and those that were seen which they go on from.

    Attributes:
        labels: (N,) int64, as of `labels_of_guesses`.
        kin: for each of the surfaces the surfels (K,) int64 that cameras saw of what it goes on from.
        kinship: for each of them what these are. PLANE: seen in its plane, at least KIN of what is guessed. BENT: of
            what goes out of sight in a bent one, as far back as it goes on; guesses on two things that are sunk into
            each other are parted by what is nearer. SIDES: else, of the thing's other sides, which it touches.
        edges: (E, 2) int64 surfels that cameras saw on both sides of edges of things.
    """

    labels: Tensor
    kin: tuple[Tensor, ...]
    kinship: tuple[str, ...]
    edges: Tensor

    @classmethod
    def of(cls, surfels: Surfels) -> GuessedSurfaces:
        """Those of surfels that know which of them are guessed."""
        centers, normals, spacing = surfels.centers.double(), surfels.normals.double(), _spacing(surfels)
        seen = surfels.guessed == 0.0
        labels = torch.full((len(surfels),), -1, device=centers.device)
        convex = _edges_of_things(centers, normals, spacing)
        edges = convex[seen[convex].all(dim=1)]
        if bool(seen.all()):
            return cls(labels, (), (), edges)
        ways = SmoothWays.among(centers.cpu().numpy(), normals.cpu().numpy(), spacing)
        beyond = _OutOfSight.of(ways, seen.cpu().numpy())
        near, kin, kinship = torch.cat([convex, convex.flip(1)]), [], []
        for own in _groups(ways.surfaces((~seen).cpu().numpy()), ~seen):
            alike = seen & _in_plane_of(own, centers, normals, spacing)
            if int(alike.sum()) >= KIN * int(own.sum()):
                parts = [(own, alike.nonzero()[:, 0], PLANE)]
            elif float(normals[own].mean(dim=0).norm()) > FLAT or not beyond.reaches(own):
                parts = [(own, near[own[near[:, 0]] & seen[near[:, 1]], 1].unique(), SIDES)]
            else:
                parts = [(part, of_part, BENT) for part, of_part in beyond.parts(own)]
            for part, of_part, how in parts:
                labels[part] = len(kin)
                kin.append(of_part)
                kinship.append(how)
        return cls(labels, tuple(kin), tuple(kinship), edges)

    def expected(self, albedo: Tensor) -> tuple[Tensor, Tensor]:
        """(N, 3) albedo that guessed surfels should have if others have `albedo` (N, 3), the median of their kin, and
        (N, 1) how much its logarithm is in doubt, as much as these differ. NaN where there are none, and where seen.

        Of a bend or of sides few may be seen: their variance is a draw of what seen ones have in common, of FREEDOM
        degrees of freedom. It is one of albedo, as what is black is known to no small part of itself."""
        found = torch.full_like(albedo, torch.nan)
        doubt = torch.full_like(albedo[:, :1], torch.nan)
        grey, common = albedo.mean(dim=1).double(), {BENT: self._along_bends(albedo), SIDES: self._across_edges(albedo)}
        for label, (kin, kinship) in enumerate(zip(self.kin, self.kinship, strict=True)):
            if not len(kin) or (kinship == SIDES and not len(self.edges)):
                continue
            own = self.labels == label
            found[own] = albedo[kin].median(dim=0).values
            if kinship == PLANE:
                doubt[own] = _spread(albedo[kin])
            else:
                variance = likely_variance(grey[kin] - grey[kin].median(), common[kinship])
                known = grey[kin].median().clamp(min=1e-3)
                doubt[own] = (variance.sqrt() / known).clamp(min=LEAST_DOUBT).to(doubt)
        return found, doubt

    def _along_bends(self, albedo: Tensor) -> Tensor:
        """() likely variance of albedo (N, 3) along bent surfaces that go out of sight."""
        grey = albedo.mean(dim=1).double()
        bends = [grey[kin] for kin, how in zip(self.kin, self.kinship, strict=True) if how == BENT and len(kin)]
        return likely_variance(torch.cat([grey[:0], *(values - values.median() for values in bends)]))

    def _across_edges(self, albedo: Tensor) -> Tensor:
        """() likely variance of what albedo (N, 3) differs by from side to side of seen things."""
        grey = albedo.mean(dim=1).double()
        return likely_variance(grey[self.edges[:, 0]] - grey[self.edges[:, 1]])


def likely_variance(differences: Tensor, common: Tensor | None = None) -> Tensor:
    """() square of the scale of Student's t with FREEDOM degrees by which differences (D,) from 0 are likeliest (EM).

    Most things are of one paint, and a few are black beside white: these alone would make a root mean square.

    Args:
        common: what it is itself a draw of, of FREEDOM degrees of freedom.
    """
    squares = differences.square()
    prior, known = (0.0, 0.0) if common is None else (FREEDOM * common, FREEDOM)
    variance = (prior + squares.sum()) / max(known + len(squares), 1.0)
    for _ in range(ROUNDS):
        weighed = (FREEDOM + 1.0) * squares / (FREEDOM + squares / variance.clamp(min=1e-12))
        variance = (prior + weighed.sum()) / max(known + len(squares), 1.0)
    return variance


def _groups(surfaces: np.ndarray, chosen: Tensor) -> list[Tensor]:
    """(N,) bool each: the `chosen` (N,) surfels of one of the `surfaces` (N,)."""
    numbers = torch.from_numpy(surfaces).to(chosen.device)
    return [chosen & (numbers == number) for number in numbers[chosen].unique()]


def _in_plane_of(own: Tensor, centers: Tensor, normals: Tensor, spacing: float) -> Tensor:
    """(N,) bool: the surfels in the plane of `own` (N,), none if these lie in none."""
    normal = normals[own].mean(dim=0)
    if float(normal.norm()) <= FLAT:
        return torch.zeros_like(own)
    normal = normal / normal.norm()
    height = (centers - centers[own].mean(dim=0)) @ normal
    return (height.abs() <= spacing) & (normals @ normal > FLAT)


@dataclass(frozen=True)
class _OutOfSight:
    """How smooth surfaces go out of sight, among N surfels.

    Attributes:
        ways: along them.
        seen: (N,) bool.
        source: (N,) the surfel that was seen from which the way to one that was not is shortest, −1 if there is none.
        length: (N,) of that way.
        things: (N,) number of the smooth surface on which this source is, −1 likewise.
    """

    ways: SmoothWays
    seen: np.ndarray
    source: np.ndarray
    length: np.ndarray
    things: np.ndarray

    @classmethod
    def of(cls, ways: SmoothWays, seen: np.ndarray) -> _OutOfSight:
        source, length = ways.sources(seen & ways.lead_to(seen))
        return cls(ways, seen, source, length, np.where(source < 0, -1, ways.surfaces(seen)[source]))

    def reaches(self, own: Tensor) -> bool:
        """Whether a guessed surface `own` (N,) goes on from one that was seen."""
        return bool((self.source[own.cpu().numpy()] >= 0).any())

    def parts(self, own: Tensor) -> list[tuple[Tensor, Tensor]]:
        """What of a guessed surface `own` (N,) goes on from each of those that were seen, and (K,) surfels of these.

        So far back as it goes on.
        """
        found = []
        for part in _groups(self.things, own):
            chosen = part.cpu().numpy()
            rim, reach = np.unique(self.source[chosen & (self.source >= 0)]), float(self.length[chosen].max())
            kin = self.ways.within(rim, self.seen, reach)
            found.append((part, torch.from_numpy(kin).to(own.device)))
        return found


def doubts_of_guesses(surfels: Surfels) -> Tensor:
    """(N,) how much the logarithm of the albedo of guessed surfels is in doubt; 0 for those that cameras saw.

    Of surfaces that go on in the plane of others it is the spread of these, else that of all that was seen: that sides
    of things are alike is expected, but that the one which nobody saw is like them no image tells.
    """
    surfaces = GuessedSurfaces.of(surfels)
    _, doubt = surfaces.expected(surfels.albedo)
    labels = surfaces.labels
    planes = torch.tensor([*(kinship == PLANE for kinship in surfaces.kinship), False], device=labels.device)[labels]
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
