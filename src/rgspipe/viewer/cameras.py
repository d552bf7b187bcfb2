"""Cameras of the browser and of the scene. viser's look along +z with +y down, the scene's along −z with +y up."""

from __future__ import annotations

import math

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from rgspipe.scene import Camera, look_at

#: Field of view of the first picture, degrees.
FIELD_OF_VIEW = 45.0

_FLIP = np.diag([1.0, -1.0, -1.0])


def camera_of(position: np.ndarray, wxyz: np.ndarray, fov: float, aspect: float, longest: int) -> Camera:
    """The camera of a canvas, with `longest` pixels along its longer side.

    Args:
        position, wxyz: of the browser's camera.
        fov: across the height, rad.
        aspect: width over height.
    """
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(np.asarray(wxyz), scalar_first=True).as_matrix() @ _FLIP
    pose[:3, 3] = position
    width, height = (longest, longest / aspect) if aspect >= 1.0 else (longest * aspect, longest)
    across = 2.0 * math.atan(math.tan(0.5 * fov) * aspect)
    return Camera.from_field_of_view(torch.from_numpy(pose), across, max(8, round(width)), max(8, round(height)))


def pose_of(camera: Camera) -> tuple[np.ndarray, np.ndarray, float]:
    """Position, wxyz and field of view across the height [rad] of a camera, for the browser."""
    pose = camera.camera_to_world.numpy()
    wxyz = Rotation.from_matrix(pose[:3, :3] @ _FLIP).as_quat(scalar_first=True)
    return pose[:3, 3], wxyz, 2.0 * math.atan(0.5 * camera.height / camera.fy)


def turned_to(axis: Tensor) -> np.ndarray:
    """wxyz of a frame whose −z is `axis`."""
    axis = axis.double()
    pose = look_at([0.0, 0.0, 0.0], axis.tolist())[:3, :3].numpy()
    return Rotation.from_matrix(pose).as_quat(scalar_first=True)


def axis_of(wxyz: np.ndarray) -> Tensor:
    """(3,) float64 −z of a frame."""
    return torch.from_numpy(Rotation.from_quat(np.asarray(wxyz), scalar_first=True).as_matrix()[:, 2] * -1.0)


def first_camera(lower: Tensor, upper: Tensor) -> Camera:
    """A camera in front of a scene, along +y, from where all of it is seen if nothing stands in the way."""
    middle, sides = (0.5 * (lower + upper)).double().cpu(), (upper - lower).double().cpu()
    back = 0.5 * float(sides.amax()) / math.tan(math.radians(0.5 * FIELD_OF_VIEW)) + 0.5 * float(sides[1])
    eye = middle - torch.tensor([0.0, 1.05 * max(back, 1e-3), 0.0], dtype=torch.float64)
    return Camera.look_at(eye, middle, fov_degrees=FIELD_OF_VIEW)
