"""Meshes of other programs: PLY, OBJ, glTF. Colours and textures become reflectance."""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import trimesh.resolvers

from rgspipe.arguments import as_path
from rgspipe.datasets.input_file import input_file, is_there
from rgspipe.datasets.json_file import shown
from rgspipe.datasets.limits import FARTHEST
from rgspipe.datasets.mesh.gltf_check import check_gltf
from rgspipe.datasets.mesh.gltf_materials import GltfMaterial, numbered
from rgspipe.datasets.mesh.links import mesh_links
from rgspipe.datasets.mesh.obj_materials import ObjMaterials
from rgspipe.datasets.mesh.obj_text import plain_obj
from rgspipe.datasets.mesh.options import FORMATS, GLTF, MeshOptions
from rgspipe.datasets.mesh.paint import check_shares, paint_of
from rgspipe.datasets.mesh.ply_polygons import with_triangles
from rgspipe.datasets.mesh.polycam_place import polycam_place
from rgspipe.datasets.mesh.texture import check_texture
from rgspipe.datasets.mesh.up import UPRIGHT, is_y_up
from rgspipe.datasets.ply.header import check_colours, check_rows, check_strips, without_texture
from rgspipe.datasets.reading_limits import RAISE, reading_limits, timed
from rgspipe.errors import InputError
from rgspipe.scene.mesh import Numbers, Paint, TriangleMesh

WHAT = "a triangle mesh (.ply, .obj, .glb or .gltf)"

#: What is said of materials that have an alphaMode, or in an MTL d or map_d.
SEE_THROUGH = "Materials of the mesh that one can see through (alphaMode, d, map_d) are taken for opaque."

#: What is said of an OBJ with pictures of what is metal, which have no place in the one that is its colour.
METAL_TEXTURES = "Pictures of what is metal (map_Pm) are not read: it is taken for as matt as the rest of the mesh."


@timed
def read_mesh(path: str | Path, options: MeshOptions | None = None) -> TriangleMesh:
    """All triangles of a file, in the world of its cameras, without those that have no area.

    Raises:
        InputError: missing or broken file, another format, no triangles, or coordinates that cannot be.
    """
    path, options = as_path(path), options or MeshOptions()
    kind = path.suffix.lower()
    if kind not in FORMATS:
        remedy = "Export it as binary PLY or GLB."
        raise InputError(path, expected=WHAT, found=f"the suffix {path.suffix!r}", remedy=remedy)
    own = OwnFiles(input_file(path, WHAT, most_bytes=reading_limits().bytes))
    content, materials = _loaded(path, own)
    try:
        parts = [_part(*placed, materials, path) for placed in _placed(content, path)]
        mesh = _joined(parts, path, content)
    except InputError:
        raise
    except (ValueError, IndexError, TypeError, KeyError, AttributeError, OSError) as error:
        raise _broken(path, error) from error
    see_through = own.obj.see_through or not all(material.opaque for material in materials)
    said = {SEE_THROUGH: see_through, METAL_TEXTURES: own.obj.metal_textures}
    mesh = replace(mesh, remarks=tuple(text for text, holds in said.items() if holds))
    scaled = np.diag([*[options.unit] * 3, 1.0])
    placed = polycam_place(path) if options.up == "auto" else None
    if placed is None:
        placed = UPRIGHT if is_y_up(path, options) else np.eye(4)
    return _checked(mesh.moved(scaled @ placed), path)


class OwnFiles(trimesh.resolvers.FilePathResolver):
    """Gives those who decode a mesh the files that belong to it, and no others: only they are in fingerprints.

    Decoders go on without what they do not get, as if nothing had been named, so that all is looked at before.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(str(path))
        self._path, self._links = path, mesh_links(path)
        self._links.there()
        if path.suffix.lower() in GLTF:
            check_gltf(path, self._links)
        else:
            self._check()

    @property
    def has_textures(self) -> bool:
        """Whether the mesh names any picture."""
        return bool(self._links.textures)

    @property
    def obj(self) -> ObjMaterials:
        """The materials of an OBJ, none of other files."""
        return self._links.materials or ObjMaterials([], {}, b"")

    def namespaced(self, namespace: str) -> OwnFiles:
        """No folder has files of its own."""
        return self

    def get(self, key: str) -> bytes:
        """The content of a file beside the mesh; of an OBJ also all of its materials, whatever they are asked by.

        Raises:
            InputError: the mesh does not name it, or it is missing.
        """
        key, links = key.strip(), self._links
        file = links.textures.get(key) or links.buffers.get(key)
        if file is not None:
            return input_file(file, f"a file that {self._path.name} names").read_bytes()
        if links.materials is not None:
            return links.materials.text
        raise InputError(self._path, expected=WHAT, found=f"another file, {shown(key)}", remedy="Export it again.")

    def _check(self) -> None:
        for file in self._links.files:
            if not is_there(file):
                remedy = f"Put it there, or take its name out of {self._path.name} or the materials that it names."
                raise InputError(
                    file, expected=f"a file that {self._path.name} names", found="no such file", remedy=remedy
                )
        for file in self._links.textures.values():
            check_texture(file.read_bytes(), file)
        if self._path.suffix.lower() == ".ply":
            check_rows(self._path)
            check_colours(self._path)
            check_strips(self._path)
        if self._path.suffix.lower() == ".ply" and len(self._links.textures) > 1:
            found, remedy = f"{len(self._links.textures)}", "Export it as GLB."
            raise InputError(self._path, expected="one texture at most in a PLY", found=found, remedy=remedy)


def _loaded(path: Path, own: OwnFiles) -> tuple[Any, list[GltfMaterial]]:
    """The scene in a file, and the materials of a glTF."""
    try:
        # Of broken files numpy warns before they are refused.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # Nothing is merged or mended: points without area do no harm, and merging would move textures.
            options = {"resolver": own, "process": False, "maintain_order": True}
            kind = path.suffix.lower()
            content, materials = numbered(path) if kind in GLTF else (path.read_bytes(), [])
            if kind == ".obj":
                content, options = plain_obj(content, path), options | {"split_groups": True}
            elif kind == ".ply" and not own.has_textures:
                content = without_texture(content)
            return trimesh.load_scene(io.BytesIO(content), file_type=kind[1:], **options), materials
    except InputError:
        raise
    except Exception as error:  # the library says of no format what it raises
        raise _broken(path, error) from error


def _broken(path: Path, error: BaseException) -> InputError:
    found = f"a file that cannot be read as one ({type(error).__name__}: {str(error)[:200]})"
    return InputError(path, expected=WHAT, found=found, remedy="Export it again.")


def _placed(content: Any, path: Path) -> list[tuple[Any, Numbers]]:
    """The triangle meshes of a scene, each with the transform (4, 4) of its node."""
    nodes = [content.graph[name] for name in content.graph.nodes_geometry]
    found = [(content.geometry[name], np.asarray(matrix, np.float64)) for matrix, name in nodes]
    placed = [(part, matrix) for part, matrix in found if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    # A mesh may stand at many nodes.
    if (count := sum(len(part.faces) for part, _ in placed)) > (most := reading_limits().vertices):
        expected, remedy = f"at most {most} triangles", f"Decimate the mesh. {RAISE}"
        raise InputError(path, expected=expected, found=f"{count} triangles", remedy=remedy)
    return placed


def _part(part: Any, matrix: Numbers, materials: list[GltfMaterial], path: Path) -> TriangleMesh:
    """One mesh, moved."""
    part = with_triangles(part, path)
    vertices, faces = np.asarray(part.vertices, np.float64), np.asarray(part.faces, np.int64)
    if faces.min() < 0 or faces.max() >= len(vertices):
        found = f"a triangle with point {int(faces.max())} of {len(vertices)}"
        raise InputError(path, expected="triangles between its points", found=found, remedy="Export it again.")
    check_shares(part, path)
    return TriangleMesh(vertices, faces, paint_of(part, faces, materials, path)).moved(matrix)


def _joined(parts: list[TriangleMesh], path: Path, content: Any) -> TriangleMesh:
    if not parts:
        points = sum(len(part.vertices) for part in content.geometry.values() if hasattr(part, "vertices"))
        found = f"{points} points and no triangle" if points else "nothing in it"
        remedy = "Make a surface of the points first (for example Poisson reconstruction in MeshLab)."
        raise InputError(path, expected=WHAT, found=found, remedy=remedy)
    points = np.cumsum([0, *(len(part.vertices) for part in parts)])
    images = np.cumsum([0, *(len(part.paint.textures) for part in parts)])
    textures = [
        np.where(part.paint.texture < 0, -1, part.paint.texture + first)
        for part, first in zip(parts, images, strict=False)
    ]
    paint = Paint(
        np.concatenate([part.paint.corners for part in parts]),
        np.concatenate([part.paint.uv for part in parts]),
        np.concatenate(textures),
        tuple(image for part in parts for image in part.paint.textures),
    )
    faces = np.concatenate([part.faces + first for part, first in zip(parts, points, strict=False)])
    return TriangleMesh(np.concatenate([part.vertices for part in parts]), faces, paint)


def _checked(mesh: TriangleMesh, path: Path) -> TriangleMesh:
    """Without triangles that have no area."""
    used = mesh.vertices[mesh.faces]
    if not (np.isfinite(used).all() and np.abs(used).max() <= FARTHEST):
        found = "points that are not finite, or farther away than 1e10"
        raise InputError(path, expected="finite coordinates", found=found, remedy="Export it again.")
    real = mesh.areas > 0.0
    if not real.any():
        found = f"{len(mesh)} triangles, none with an area"
        raise InputError(path, expected=WHAT, found=found, remedy="Export it again.")
    paint = mesh.paint
    paint = Paint(paint.corners[real], paint.uv[real], paint.texture[real], paint.textures)
    return replace(mesh, faces=mesh.faces[real], paint=paint)
