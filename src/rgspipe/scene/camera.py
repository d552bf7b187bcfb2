"""A pinhole camera and the rays through its pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.arguments import as_count, as_number
from rgspipe.errors import InputError
from rgspipe.scene.arrays import ArrayLike, as_tensor, check_finite
from rgspipe.scene.by_value import ByValue
from rgspipe.scene.pinhole import Pinhole
from rgspipe.scene.rigid import check_rigid
from rgspipe.scene.shapes import Float, Given

#: What to check where a camera sees nothing.
AXES = (
    "cameras are in the scene's coordinates (camera-to-world, not its inverse) and look along −z, with +y up (from "
    "OpenCV, change the sign of their second and third column)"
)

#: What a pose is given as.
ROWS = "Pass four rows of four numbers, the last of them 0, 0, 0, 1."

#: What to do about a number of pixels that is none.
ROUND = "Round it up."

#: Of rays, across the axis over along it: beyond it their squares, which lengths are made of, may not be finite.
STEEPEST = 1e100

#: Radians across the narrowest image: telescopes see a hundred times as much.
NARROWEST = 1e-6

#: Fewer degrees than these are radians, which somebody forgot to convert.
LEAST_DEGREES = 3.2

#: Of a focal length that is computed from an angle.
ROUNDING = 1e-9


@dataclass(frozen=True)
class _Pose:
    """Where a camera stands and how it is turned; apart, so that it is the first that a camera is given."""

    camera_to_world: Given


@dataclass(frozen=True)
class Camera(ByValue, Pinhole, _Pose):
    """A pinhole camera with OpenGL axes: it looks along its −z, +y is up, +x is right.

    Pixel (column x, row y) has its centre at (x + 0.5, y + 0.5); row 0 is the top of the image.

    Attributes:
        camera_to_world: (4, 4) float64 rigid transform, scene units; given as a list, numpy array or tensor.
        fx, fy: focal lengths in pixels.
        cx, cy: principal point in pixels.
        width, height: image size in pixels.

    Raises:
        InputError: the transform is not rigid, a focal length of no lens, a size not a whole number of pixels, or a
            number not finite.
    """

    def __post_init__(self) -> None:
        pose = as_tensor(self.camera_to_world, "camera_to_world", (4, 4), torch.float64, ROWS)
        check_finite(pose, "camera_to_world", "Check where the camera stands and where it looks.")
        check_rigid(pose.detach().cpu().numpy(), "camera_to_world")
        object.__setattr__(self, "camera_to_world", pose)
        for name in ("width", "height"):
            object.__setattr__(self, name, as_count(getattr(self, name), name, remedy=ROUND))
        for name in ("cx", "cy"):
            as_number(getattr(self, name), name)
        for focal, centre, size in (("fx", self.cx, self.width), ("fy", self.cy, self.height)):
            _check_focal_length(focal, getattr(self, focal), abs(centre) + size, max(self.width, self.height))

    @classmethod
    def look_at(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        *,
        fov_degrees: float = 40.0,
        width: int = 256,
        height: int = 256,
        up: ArrayLike | None = None,
    ) -> Camera:
        """A camera at `eye` whose axis goes through `target`, both (3,) scene units.

        Args:
            fov_degrees: field of view across the width, 3.2 at least: less is taken for radians, and refused.
            width, height: image size in pixels, which are square.
            up: (3,) what is up in the image; +z if None, or +y for a view along z.

        Raises:
            InputError: a point is not three numbers, both are one, or the field of view or a size is out of range.
        """
        remedy = "40 is usual; Camera.from_field_of_view takes radians, and narrower views."
        expected, below = f"an angle from {LEAST_DEGREES} to below 180 degrees", math.nextafter(180.0, 0.0)
        as_number(fov_degrees, "fov_degrees", remedy, expected=expected, low=LEAST_DEGREES, high=below)
        return cls.from_field_of_view(look_at(eye, target, up), math.radians(fov_degrees), width, height)

    @classmethod
    def from_field_of_view(cls, camera_to_world: ArrayLike, angle_x: float, width: int, height: int) -> Camera:
        """A camera with square pixels, its axis through the middle, and `angle_x` [rad] across the width."""
        width, height = as_count(width, "width", remedy=ROUND), as_count(height, "height", remedy=ROUND)
        focal = 0.5 * width / math.tan(0.5 * angle_x)
        return cls(camera_to_world, focal, focal, 0.5 * width, 0.5 * height, width, height)

    @property
    def origin(self) -> Float[Tensor, " 3"]:
        """(3,) float64, the centre of projection."""
        return self.camera_to_world[:3, 3]

    @property
    def key(self) -> bytes:
        """Tells cameras apart: equal for those that see the same."""
        numbers = (self.fx, self.fy, self.cx, self.cy, self.width, self.height)
        return self.camera_to_world.numpy().tobytes() + repr(numbers).encode()

    @property
    def pixel_count(self) -> int:
        """Number of its pixels."""
        return self.width * self.height

    def resized(self, width: int, height: int | None = None) -> Camera:
        """The same view in images of another size; without a height as high as the width asks for, rounded."""
        return super().resized(width, max(1, round(self.height * width / self.width)) if height is None else height)

    def reduced(self, longest_side: int) -> Camera:
        """The same view with at most `longest_side` pixels along the longer side, at least one along the other."""
        factor = max(1.0, max(self.width, self.height) / longest_side)
        return self.resized(max(1, round(self.width / factor)), max(1, round(self.height / factor)))

    def rays(
        self, pixels: Tensor | None = None, subsamples: int = 1, places: Tensor | None = None
    ) -> tuple[Float[Tensor, "R 3"], Float[Tensor, "R 3"], Float[Tensor, " R"]]:
        """Rays through a regular `subsamples × subsamples` grid in each pixel, or through given places in it.

        Args:
            pixels: (P,) int64 flat indices, row · width + column; all pixels in order, on the CPU, if None.
            subsamples: grid size per pixel; 1 is the pixel centre.
            places: (s², 2) float64 columns and rows within the pixel, in [0, 1], instead of the grid.

        Returns:
            origins (P·s², 3), unit directions (P·s², 3), and the length along a ray per unit of planar
            depth (P·s²,) — multiply planar z by it to get the ray distance. float64, where `pixels` are; the
            rays of one pixel stand together.
        """
        pixels = torch.arange(self.pixel_count) if pixels is None else pixels
        if places is None:
            step = (torch.arange(subsamples, dtype=torch.float64) + 0.5) / subsamples
            sub_y, sub_x = torch.meshgrid(step, step, indexing="ij")
            places = torch.stack([sub_x.reshape(-1), sub_y.reshape(-1)], dim=1)
        places, pose = places.to(pixels.device), self.camera_to_world.to(pixels.device)
        column = (pixels % self.width)[:, None] + places[:, 0]
        row = torch.div(pixels, self.width, rounding_mode="floor")[:, None] + places[:, 1]
        local = torch.stack(
            [(column - self.cx) / self.fx, -(row - self.cy) / self.fy, -torch.ones_like(column)], dim=-1
        ).reshape(-1, 3)
        directions = local @ pose[:3, :3].T
        lengths = directions.norm(dim=1)
        directions = directions / lengths[:, None]
        return pose[:3, 3].expand_as(directions), directions, lengths

    def project(self, points: Float[Tensor, "*B 3"]) -> tuple[Float[Tensor, "*B 2"], Float[Tensor, "*B"]]:
        """Pixel coordinates (…, 2) and planar depth (…,) of world points (…, 3); depth ≤ 0 is behind."""
        rotation = self.camera_to_world[:3, :3]
        local = (points.double() - self.origin) @ rotation
        depth = -local[..., 2]
        scale = 1.0 / torch.where(depth.abs() > 1e-12, depth, torch.full_like(depth, 1e-12))
        x = self.cx + self.fx * local[..., 0] * scale
        y = self.cy - self.fy * local[..., 1] * scale
        return torch.stack([x, y], dim=-1), depth


def _check_focal_length(name: str, length: float, reach: float, size: int) -> None:
    """Refuse a focal length that no lens has, of an image of `size` pixels across that reach so far from its axis.

    Raises:
        InputError: it is not positive, so short that directions have no length in double precision, or so long that
            the image shows one direction.
    """
    expected, remedy = "a focal length in pixels, above 0", "Axes with another sign belong into camera_to_world."
    if not 0.0 < reach < STEEPEST * as_number(length, name, remedy, expected=expected):
        raise InputError(name, expected=expected, found=f"{length}", remedy=remedy)
    if length > longest_focal(size) * (1.0 + ROUNDING):
        expected = f"at most {longest_focal(size):g} pixels for {size} pixels across"
        raise InputError(name, expected=expected, found=f"{length:g}", remedy="Focal lengths are in pixels.")


def longest_focal(size: int) -> float:
    """The longest focal length in pixels of an image that is so many pixels across."""
    return size / NARROWEST


def look_at(origin: ArrayLike, target: ArrayLike, up: ArrayLike | None = None) -> Float[Tensor, "4 4"]:
    """(4, 4) float64 camera-to-world matrix of a camera at `origin` that looks at `target`.

    `up` defaults to +z; when the view is along it, +y takes its place.

    Raises:
        InputError: both are the same point, or a point is not three numbers.
    """
    origin, target = (as_tensor(x, name, (3,), torch.float64) for x, name in ((origin, "eye"), (target, "target")))
    up = as_tensor([0.0, 0.0, 1.0] if up is None else up, "up", (3,), torch.float64)
    if torch.equal(origin, target):
        found = f"{tuple(origin.tolist())}, where the camera stands"
        raise InputError("target", expected="a point in front of the camera", found=found, remedy="Move either.")
    backward = torch.nn.functional.normalize(origin - target, dim=0)
    if torch.linalg.cross(up, backward).norm() < 1e-6:
        up = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
    right = torch.nn.functional.normalize(torch.linalg.cross(up, backward), dim=0)
    matrix = torch.eye(4, dtype=torch.float64)
    matrix[:3, 0], matrix[:3, 1] = right, torch.linalg.cross(backward, right)
    matrix[:3, 2], matrix[:3, 3] = backward, origin
    return matrix
