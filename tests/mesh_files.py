"""Meshes of small rooms, and files of them."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from raycast import Cuboid
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.datasets.mesh.options import MeshOptions
from rgspipe.scene import srgb
from rgspipe.scene.mesh import Paint, TriangleMesh

#: What `quarters` shows: red and green above, blue and grey below.
QUARTERS = np.array([[200, 0, 0], [0, 200, 0], [0, 0, 200], [90, 90, 90]])

#: Corners of a cube's six sides, by signs.
SIDES = [
    [[axis_sign if d == axis else (a if d == (axis + 1) % 3 else b) for d in range(3)] for a, b in corners]
    for axis in range(3)
    for axis_sign in (-1, 1)
    for corners in [((-1, -1), (1, -1), (1, 1), (-1, 1))]
]


def cuboid_triangles(box: Cuboid) -> tuple[np.ndarray, np.ndarray]:
    """(24, 3) points, four a side, and (12, 3) triangles, wound as it happens."""
    points = 0.5 * np.array(SIDES, np.float64).reshape(-1, 3) * np.array(box.size) @ box.axes + np.array(box.center)
    faces = np.array([[4 * side, 4 * side + one, 4 * side + one + 1] for side in range(6) for one in (1, 2)])
    return points, faces


def unpainted(vertices: np.ndarray, faces: np.ndarray) -> TriangleMesh:
    count = len(faces)
    paint = Paint(np.full((count, 3, 3), np.nan), np.zeros((count, 3, 2)), np.full(count, -1))
    return TriangleMesh(np.asarray(vertices, np.float64), np.asarray(faces, np.int64), paint)


def joined(*boxes: Cuboid) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of several boxes."""
    parts = [cuboid_triangles(box) for box in boxes]
    faces = [faces + 24 * number for number, (_, faces) in enumerate(parts)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(faces)


def boxes_mesh(*boxes: Cuboid) -> TriangleMesh:
    return unpainted(*joined(*boxes))


def write_coloured(path: Path, vertices: np.ndarray, faces: np.ndarray, colours: np.ndarray) -> None:
    """Colours (V, 3) in bytes at the points, in the format of the suffix."""
    trimesh.Trimesh(vertices, faces, vertex_colors=colours, process=False).export(path)


def textured_square(image: Image.Image) -> trimesh.Trimesh:
    """A unit square in z = 0 whose texture begins at its lower left corner."""
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    material = trimesh.visual.material.SimpleMaterial(image=image, diffuse=[255, 255, 255, 255])
    visual = trimesh.visual.TextureVisuals(uv=np.array(points, float)[:, :2], material=material)
    return trimesh.Trimesh(points, [[0, 1, 2], [0, 2, 3]], visual=visual, process=False)


def quarters() -> Image.Image:
    """4 × 4 pixels: red and green above, blue and grey below."""
    levels = np.zeros((4, 4, 3), np.uint8)
    levels[:2, :2], levels[:2, 2:], levels[2:, :2], levels[2:, 2:] = [200, 0, 0], [0, 200, 0], [0, 0, 200], [90] * 3
    return Image.fromarray(levels)


def painted(path: Path) -> np.ndarray:
    """(4, 3) levels of 255 that the file of a textured square has in its quarters; see QUARTERS."""
    mesh = read_mesh(path, MeshOptions(up="z"))
    places = np.array([[0.2, 0.9], [0.8, 0.9], [0.3, 0.1], [0.9, 0.1]])
    found = []
    for x, y in places:  # in the lower triangle, then in the upper one
        face, shares = (0, [1 - x, x - y, y]) if y <= x else (1, [1 - y, x, y - x])
        found.append(mesh.paint.at(np.array([face]), np.array([shares]))[0])
    return np.round(255.0 * srgb.encode(np.array(found)))


def gltf_parts(folder: Path) -> tuple[dict, bytes]:
    """The JSON and the buffer of a textured square."""
    trimesh.Scene(textured_square(quarters())).export(folder / "square.glb")
    content = (folder / "square.glb").read_bytes()
    length = int.from_bytes(content[12:16], "little")
    return json.loads(content[20 : 20 + length]), content[28 + length :]


def write_glb(path: Path, content: dict, buffer: bytes) -> Path:
    text = json.dumps(content).encode()
    text = text.ljust(-(-len(text) // 4) * 4)
    chunks = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(buffer)) + b"BIN\0" + buffer
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return path
