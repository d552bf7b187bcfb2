"""Meshes of every format, and the files that they name, each with what writes it and what reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
import trimesh

from mesh_files import cuboid_triangles, quarters, textured_square, write_coloured
from raycast import ROOM
from readable_captures import Kind, Numbers
from rgspipe.datasets.mesh.file import read_mesh


def _mesh(name: str, make: Callable[[Path], object] | None = None) -> Kind:
    """By default a textured square."""

    def read(folder: Path) -> Numbers:
        mesh = read_mesh(folder / name)
        weights = np.full((len(mesh), 3), 1.0 / 3.0)
        colours = np.nan_to_num(mesh.paint.at(np.arange(len(mesh)), weights), nan=0.0)
        return iter([torch.from_numpy(mesh.vertices[mesh.faces]), torch.from_numpy(colours)])

    return Kind(name, make or (lambda folder: textured_square(quarters()).export(folder / name)), read)


def _beside(mesh: str, file: str) -> Kind:
    """A file that the mesh of a textured square names."""
    return replace(_mesh(mesh), file=file)


def _coloured(folder: Path) -> None:
    write_coloured(folder / "a.ply", *cuboid_triangles(ROOM), np.full((24, 3), 99, np.uint8))


def _textured_ply(folder: Path) -> None:
    """Whose header names its picture, as MeshLab writes it."""
    quarters().save(folder / "t.png")
    content = textured_square(quarters()).export(file_type="ply")
    (folder / "a.ply").write_bytes(content.replace(b"\nelement", b"\ncomment TextureFile t.png\nelement", 1))


def _linking(folder: Path) -> None:
    """A glTF file whose picture lies beside it."""
    files = trimesh.Scene(textured_square(quarters())).export(file_type="gltf")
    for name, content in files.items():
        (folder / ("a.gltf" if name == "model.gltf" else name)).write_bytes(content)


MESHES: dict[str, Kind] = {
    "mesh, PLY": _mesh("a.ply", _coloured),
    "mesh, PLY with a picture": _mesh("a.ply", _textured_ply),
    "mesh, OBJ": _mesh("a.obj"),
    "mesh, GLB": _mesh("a.glb"),
    "mesh, glTF": _mesh("a.gltf", _linking),
    "mesh, materials": _beside("a.obj", "material.mtl"),
    "mesh, buffer": _beside("a.gltf", "gltf_buffer_0.bin"),
    "mesh, texture": _beside("a.obj", "material_0.png"),
}
