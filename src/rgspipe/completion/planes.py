"""Flat surfaces among surfels: what a room is built of, and which way it is turned."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.scene.surfels import Surfels

#: Surfels of one plane lie within so many distances of neighbours from it, and face within this angle [rad] of it.
OFFSET, TURN = 0.5, math.radians(15.0)

#: Fewest surfels of a plane: about what a patch of 4 × 4 has, below which its tilt is not known well enough to be
#: continued over several times its own length.
FEWEST = 16

#: Surfels from which a plane is tried at once; planes are looked for until none is found from so many of the rest.
TRIED = 256


@dataclass(frozen=True)
class Plane:
    """A plane and the surfels on it.

    Attributes:
        normal: (3,) float64 unit, to the front of its surfels.
        offset: n · x of its points, scene units.
        members: (M,) int64 indices of its surfels.
    """

    normal: Tensor
    offset: float
    members: Tensor

    def turned(self, frame: Tensor) -> Plane:
        """The same in coordinates along the rows of `frame` (3, 3)."""
        return Plane(frame @ self.normal, self.offset, self.members)


def planes_of(surfels: Surfels, spacing: float) -> list[Plane]:
    """The planes with FEWEST surfels or more, those with most first; no surfel is on two.

    Args:
        spacing: distance of neighbours.
    """
    centers, normals = surfels.centers.double().cpu(), surfels.normals.double().cpu()
    rest, found = torch.arange(len(centers)), []
    while len(rest) >= FEWEST:
        tried = rest[torch.linspace(0, len(rest) - 1, min(TRIED, len(rest))).round().long()]
        normal, offset = normals[tried], (normals[tried] * centers[tried]).sum(dim=1)
        on = _on(centers[rest], normals[rest], normal, offset, spacing)
        best = int(on.sum(dim=0).argmax())
        members = rest[on[:, best]]
        for _ in range(2):
            if len(members) < FEWEST:
                return found
            normal, offset = _fitted(centers[members], normals[members])
            members = rest[_on(centers[rest], normals[rest], normal[None], offset[None], spacing)[:, 0]]
        if len(members) < FEWEST:
            return found
        found.append(Plane(normal, float(offset), members))
        rest = rest[~torch.isin(rest, members)]
    return found


def frame_of(planes: list[Plane]) -> Tensor:
    """(3, 3) float64 rotation whose rows are the axes of a room, those nearest to x, y and z in this order.

    The largest plane gives one axis and the largest of those across it the second. Without two such planes the axes
    stay as they are.
    """
    if not planes:
        return torch.eye(3, dtype=torch.float64)
    first = planes[0].normal
    across = [plane for plane in planes[1:] if abs(float(plane.normal @ first)) < math.sin(TURN)]
    if not across:
        return torch.eye(3, dtype=torch.float64)
    second = across[0].normal - (across[0].normal @ first) * first
    second = second / second.norm()
    axes = torch.stack([first, second, torch.linalg.cross(first, second)])
    order = _nearest_order(axes)
    signs = axes[order].diagonal().sign()
    axes = axes[order] * torch.where(signs == 0.0, torch.ones_like(signs), signs)[:, None]
    if float(torch.linalg.det(axes)) < 0.0:
        axes[2] = -axes[2]
    return axes


def _nearest_order(axes: Tensor) -> Tensor:
    """The order of rows in which their sizes along x, y and z add up to most."""
    orders = torch.tensor([[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]])
    sums = axes.abs()[orders].diagonal(dim1=1, dim2=2).sum(dim=1)
    return orders[int(sums.argmax())]


def _on(centers: Tensor, normals: Tensor, normal: Tensor, offset: Tensor, spacing: float) -> Tensor:
    """(N, P) bool: whether surfels (N) lie on planes (P)."""
    near = (centers @ normal.T - offset).abs() < OFFSET * spacing
    return near & (normals @ normal.T > math.cos(TURN))


def _fitted(centers: Tensor, normals: Tensor) -> tuple[Tensor, Tensor]:
    """Normal (3,) and offset of the plane with the least squared distances from (M, 3)."""
    middle = centers.mean(dim=0)
    _, _, axes = torch.linalg.svd(centers - middle, full_matrices=False)
    normal = axes[2] * torch.sign((normals @ axes[2]).sum())
    return normal, normal @ middle
