"""Hard scenes by name: what a renderer meets when it is used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch
from torch import Tensor

from rgspipe.scene import Surfels
from rooms import closed_box, rectangle, surfels_on

INSIDE = torch.tensor([0.05, -0.1, 0.15], dtype=torch.float64)


def room() -> Surfels:
    """A closed box of 384 surfels with a screen in the middle, so that there are shadows."""
    box = closed_box(1 / 8)
    points, normals = rectangle([-0.2, -0.2, -0.1], [0.4, 0, 0], [0, 0.4, 0], 0.05)
    screen = surfels_on(points, normals, 0.05)
    joined = {name: torch.cat([tensor, screen.tensors()[name]]) for name, tensor in box.tensors().items()}
    return replace(box, **joined)


def _with(**changes: Callable[[Surfels], Tensor]) -> Surfels:
    surfels = room()
    return replace(surfels, **{name: change(surfels) for name, change in changes.items()})


def scaled(factor: float) -> Surfels:
    """The room with every length multiplied."""
    surfels = room()
    coverage = surfels.coverage
    lengths = {"layer_thickness": coverage.layer_thickness, "clip_softness": coverage.clip_softness}
    return replace(
        surfels,
        centers=factor * surfels.centers,
        scales=factor * surfels.scales,
        clip_offsets=factor * surfels.clip_offsets,
        coverage=replace(coverage, **{name: factor * value for name, value in lengths.items()}),
    )


def one_surfel() -> Surfels:
    surfels = room()
    return replace(surfels, **{name: tensor[:1] for name, tensor in surfels.tensors().items()})


def no_surfel() -> Surfels:
    surfels = room()
    return replace(surfels, **{name: tensor[:0] for name, tensor in surfels.tensors().items()})


def layers() -> Surfels:
    """A thousand opaque sheets, one behind the other."""
    points = torch.stack([torch.zeros(1000), torch.zeros(1000), torch.linspace(-0.4, 0.4, 1000)], dim=1)
    return surfels_on(points, torch.tensor([[0.0, 0.0, 1.0]]).expand(1000, 3), 0.2)


SCENES: dict[str, Callable[[], Surfels]] = {
    "plain": room,
    "surfels of zero area": lambda: _with(scales=lambda s: s.scales * (torch.arange(len(s)) % 2)[:, None]),
    "surfels of zero width": lambda: _with(scales=lambda s: s.scales * torch.tensor([1.0, 0.0])),
    "anisotropy of 1e4": lambda: _with(scales=lambda s: s.scales * torch.tensor([1.0, 1e-4])),
    "coincident duplicates": lambda: replace(
        room(), **{name: torch.cat([tensor, tensor]) for name, tensor in room().tensors().items()}
    ),
    "opacity 0": lambda: _with(opacities=lambda s: torch.zeros_like(s.opacities)),
    "opacity 1": lambda: _with(opacities=lambda s: torch.ones_like(s.opacities)),
    "albedo 0": lambda: _with(albedo=lambda s: torch.zeros_like(s.albedo)),
    "albedo 1 in a closed room": lambda: _with(albedo=lambda s: torch.ones_like(s.albedo)),
    "one surfel": one_surfel,
    "no surfel": no_surfel,
    "a thousand layers": layers,
    "a scene of size 1e-3": lambda: scaled(1e-3),
    "a scene of size 1e3": lambda: scaled(1e3),
}

#: Where the light is, for a scene of size 1; the wall x = −0.5 has a surfel at WALL with normal +x.
WALL = torch.tensor([-0.5, 0.0625, 0.0625], dtype=torch.float64)
LIGHTS: dict[str, Tensor] = {
    "in the open": INSIDE,
    "on a surfel": WALL,
    "1e-6 from a surfel": WALL + torch.tensor([1e-6, 0.0, 0.0]),
    "behind a surfel": WALL - torch.tensor([1e-3, 0.0, 0.0]),
    "outside of the room": torch.tensor([3.0, 0.0, 0.0], dtype=torch.float64),
    "grazing": torch.tensor([0.0, 0.0, -0.1], dtype=torch.float64),
    "very far": torch.tensor([1e6, 1e5, 0.0], dtype=torch.float64),
}
