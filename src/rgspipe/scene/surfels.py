"""Gaussian surfels: oriented, anisotropic discs with a Gaussian opacity profile and up to two straight edges."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from rgspipe.arguments import as_number
from rgspipe.errors import InputError
from rgspipe.scene.arrays import as_tensor, check_finite
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.shapes import Float, Given

if TYPE_CHECKING:
    from rgspipe.datasets.ply.file import PlyOptions

#: Entries of each surfel in its tensors.
ENTRIES = {
    "centers": (3,),
    "rotations": (4,),
    "scales": (2,),
    "opacities": (),
    "albedo": (3,),
    "clip_offsets": (2,),
    "clip_angles": (2,),
    "guessed": (),
}

#: What is possible where not every number is: the least and the most, with the rounding of float32.
RANGES = {
    "scales": (0.0, math.inf),
    "opacities": (-1e-5, 1.0 + 1e-5),
    "albedo": (-1e-5, 1.0 + 1e-5),
    "guessed": (0.0, math.inf),
}

#: A clip offset that never clips: beyond the footprint of any surfel, whatever the scene's unit. A power of two, so
#: that it is the same in float32 and float64.
NO_CLIP = 2.0**40


@dataclass(frozen=True)
class Coverage:
    """How overlapping surfels become opaque surfaces: one definition for views, gather and shadows.

    Hits within `layer_thickness` along a ray form one layer. The layer's raw coverage
    1 − Π(1−α) is sharpened by smoothstep(low, high) and shared among its surfels in proportion to α,
    without order; layers are composited front to back.

    Attributes:
        low, high: raw coverage at which a layer is empty and fully opaque.
        layer_thickness: scene units along the ray.
        clip_softness: width of the ramp at a half-plane clip, scene units.
        minimum_alpha: opacity below which a surfel is not there at all; bounds its footprint.
    """

    low: float
    high: float
    layer_thickness: float
    clip_softness: float
    minimum_alpha: float = 0.01

    def __post_init__(self) -> None:
        for field in fields(self):
            as_number(getattr(self, field.name), f"coverage.{field.name}")
        if not 0.0 <= self.low < self.high <= 1.0:
            raise ValueError(f"coverage needs 0 ≤ low < high ≤ 1, got {self.low} and {self.high}")
        if not (self.layer_thickness > 0.0 and self.clip_softness > 0.0 and 0.0 < self.minimum_alpha < 1.0):
            raise ValueError(
                "coverage needs layer_thickness > 0, clip_softness > 0 and 0 < minimum_alpha < 1, got "
                f"{self.layer_thickness}, {self.clip_softness} and {self.minimum_alpha}"
            )


@dataclass(frozen=True, eq=False, repr=False)
class Surfels:
    """N Gaussian surfels as plain tensors, all of one dtype and device; lists and numpy arrays are taken for them.

    The opacity of surfel i at a point x of its plane, with local coordinates u, v along its axes:

        α = opacity · exp(−½(u²/s_u² + v²/s_v²)) · Π_k clamp(½ + (b_k − (u, v)·(cos φ_k, sin φ_k))/w, 0, 1)

    Attributes:
        centers: (N, 3) scene units.
        rotations: (N, 4) unit quaternions (w, x, y, z) that turn the axes x, y, z into u, v, normal.
        scales: (N, 2) standard deviations along u and v, scene units.
        opacities: (N,) in [0, 1].
        albedo: (N, 3) diffuse reflectance in [0, 1].
        clip_offsets: (N, 2) distance b of the edges from the centre, scene units; NO_CLIP for none.
        clip_angles: (N, 2) direction φ of the edges' outward normals in the (u, v) plane, rad.
        coverage: how surfels compose to surfaces; belongs to the scene, as it was trained with it.
        gloss: what they reflect besides, or None if all of them are diffuse.
        guessed: (N,) where no camera saw the surface and it was added to close the scene, the standard deviation of the
            logarithm of its albedo; 0 where one did, and None for 0 everywhere.

    Raises:
        InputError: a tensor has another shape.
        ValueError: the gloss is that of another number of surfels.
    """

    centers: Given
    rotations: Given
    scales: Given
    opacities: Given
    albedo: Given
    clip_offsets: Given
    clip_angles: Given
    coverage: Coverage
    gloss: Gloss | None = None
    guessed: Given | None = None

    def __post_init__(self) -> None:
        count: int | str = "N"
        if self.guessed is None:
            opacities = as_tensor(self.opacities, "surfels.opacities", ("N",))
            object.__setattr__(self, "guessed", torch.zeros_like(opacities))
        for name, entries in ENTRIES.items():
            tensor = as_tensor(getattr(self, name), f"surfels.{name}", (count, *entries))
            object.__setattr__(self, name, tensor)
            count = len(tensor)
        if self.gloss is not None and len(self.gloss) != count:
            raise ValueError(f"surfels.gloss must be of {count} surfels, got {len(self.gloss)}")

    def check(self) -> None:
        """Refuse what no scene is made of; without surfels it is empty, and black.

        Raises:
            InputError: a number is not finite or impossible, such as an albedo above 1.
            ValueError: see `Gloss.check`.
        """
        for name, tensor in self.tensors().items():
            check_finite(tensor, f"surfels.{name}", "Look where they were made.")
            low, high = RANGES.get(name, (-math.inf, math.inf))
            if bool(((tensor < low) | (tensor > high)).any()):
                expected = "lengths, 0 or more" if high == math.inf else "values from 0 to 1"
                found = f"{float(tensor.min()):.4g} to {float(tensor.max()):.4g}"
                raise InputError(f"surfels.{name}", expected=expected, found=found, remedy="Correct or clamp them.")
        if not bool(self.rotations.any(dim=1).all()):
            expected, remedy = "quaternions with a length", "Pass (1, 0, 0, 0) for one that is not turned."
            raise InputError("surfels.rotations", expected=expected, found="(0, 0, 0, 0)", remedy=remedy)
        if self.gloss is not None:
            self.gloss.check(self.albedo)

    def __len__(self) -> int:
        return self.centers.shape[0]

    def __repr__(self) -> str:
        glossy = 0 if self.gloss is None else len(self.gloss.glossy)
        return f"Surfels({len(self)}, {glossy or 'none'} of them glossy, {self.centers.dtype}, {self.centers.device})"

    @classmethod
    def from_ply(cls, path: str | Path, options: PlyOptions | None = None) -> Surfels:
        """The surfels in a PLY file of this program, or of 3DGS, 2DGS or RadiosityGS; float32 on the CPU.

        `load_ply` does the same, and tells what of a file could not be taken over.

        Args:
            options: what files from elsewhere do not say of themselves, such as which side of a surfel is its front.

        Raises:
            InputError: no PLY file, a property is missing or has impossible values, or nothing says which side of the
                surfels is their front.
        """
        # Files are for those above; this is the door to them that people look for here.
        from rgspipe import load_ply

        return load_ply(path, options)[0]

    @property
    def frames(self) -> Float[Tensor, "N 3 3"]:
        """(N, 3, 3) orthonormal axes; [:, 0] is u, [:, 1] is v, [:, 2] the normal."""
        return quaternion_to_axes(self.rotations)

    @property
    def normals(self) -> Float[Tensor, "N 3"]:
        """(N, 3) unit normals."""
        return self.frames[:, 2]

    def to(self, *args: torch.dtype | torch.device | str) -> Surfels:
        """A copy with every tensor moved by `Tensor.to`."""
        moved = {name: tensor.to(*args) for name, tensor in self.tensors().items()}
        return replace(self, **moved, gloss=None if self.gloss is None else self.gloss.to(*args))

    def selected(self, index: Tensor) -> Surfels:
        """Those of `index` (M,)."""
        parts = {name: tensor[index] for name, tensor in self.tensors().items()}
        return replace(self, **parts, gloss=None if self.gloss is None else self.gloss.selected(index))

    def detached(self) -> Surfels:
        """The same numbers without their gradients."""
        own = {name: tensor.detach() for name, tensor in self.tensors().items()}
        return replace(self, **own, gloss=None if self.gloss is None else self.gloss.detached())

    def tensors(self) -> dict[str, Tensor]:
        """The surfels' own tensors by name, as they are stored; those of `gloss` are its own."""
        return {name: getattr(self, name) for name in tensor_names()}


def tensor_names() -> list[str]:
    """Names of the surfels' own tensors."""
    return [field.name for field in fields(Surfels) if field.name not in ("coverage", "gloss")]


def quaternion_to_axes(quaternions: Float[Tensor, "N 4"]) -> Float[Tensor, "N 3 3"]:
    """(N, 3, 3) rows u, v, normal of the rotations (N, 4) (w, x, y, z); quaternions are normalised first."""
    w, x, y, z = torch.nn.functional.normalize(quaternions, dim=-1).unbind(-1)
    u = torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], dim=-1)
    v = torch.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], dim=-1)
    n = torch.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], dim=-1)
    return torch.stack([u, v, n], dim=-2)


def quaternion_from_normal(normals: Float[Tensor, "N 3"]) -> Float[Tensor, "N 4"]:
    """(N, 4) shortest rotations from +z to the unit normals (N, 3); −z turns about x."""
    x, y, z = normals.unbind(-1)
    across = x * x + y * y
    opposite = (z < 0.0) & (across < 1e-20)
    # 1 + z, without the cancellation next to −z.
    w = torch.where(z < 0.0, across / (1.0 - z), 1.0 + z)
    quaternion = torch.stack([w, -y, x, torch.zeros_like(x)], dim=-1)
    about_x = torch.tensor([0.0, 1.0, 0.0, 0.0], dtype=normals.dtype, device=normals.device)
    quaternion = torch.where(opposite[:, None], about_x, quaternion)
    return torch.nn.functional.normalize(quaternion, dim=-1)


def turn_in_plane(quaternions: Float[Tensor, "N 4"], angles: Float[Tensor, " N"]) -> Float[Tensor, "N 4"]:
    """Rotations (N, 4) turned by `angles` (N,) [rad] about their own normals."""
    w, x, y, z = quaternions.unbind(-1)
    c, s = torch.cos(0.5 * angles), torch.sin(0.5 * angles)
    return torch.stack([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s], dim=-1)
