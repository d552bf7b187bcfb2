"""Furniture of other makers: libraries of Sweet Home 3D (`.sh3f`), as Debian's `sweethome3d-furniture` installs."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

#: Rooms that pieces are taken from: what stands in the open, hangs or drives is left out.
CATEGORIES = ("Living room", "Bedroom", "Office", "Kitchen", "Bathroom")
#: How large a piece is [m]: its sides on the floor and its height.
SIDES, HEIGHT = (0.3, 1.6), (0.35, 2.2)
#: Triangles, above which a piece takes longer to read than to photograph.
TRIANGLES = 60_000
#: Reflectance that files which say black or more than paint can reflect are given.
REFLECTANCE = (0.05, 0.9)
CATALOGUE = "PluginFurnitureCatalog.properties"


@dataclass(frozen=True)
class Piece:
    """A piece of furniture in a library.

    Attributes:
        library: the `.sh3f` file.
        model: path of its OBJ file within the library.
        size: (3,) width, depth and height [m].
    """

    library: Path
    model: str
    size: np.ndarray

    def parts(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Vertices in [-1, 1]³ (+z up), triangles, and the reflectance of each part of one material."""
        with zipfile.ZipFile(self.library) as library:
            folder = Path(self.model).parent
            beside = [name for name in library.namelist() if Path(name).parent == folder and not name.endswith("/")]
            files = {Path(name).name: io.BytesIO(library.read(name)) for name in beside}
        resolver = trimesh.resolvers.ZipResolver(files)
        obj = files[Path(self.model).name]
        scene = trimesh.load(obj, file_type="obj", force="scene", resolver=resolver, process=False, group_material=True)
        low, high = scene.bounds
        if sum(len(mesh.faces) for mesh in scene.geometry.values()) > TRIANGLES:
            raise ValueError(f"{self.model} has more than {TRIANGLES} triangles.")
        return [_part(mesh, low, high) for mesh in scene.geometry.values() if len(mesh.faces)]


def _part(mesh: trimesh.Trimesh, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    # OBJ files of these libraries have +y up and look along +z.
    unit = (mesh.vertices - low) / np.maximum(high - low, 1e-9) * 2.0 - 1.0
    vertices = unit @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return vertices, np.asarray(mesh.faces), np.clip(_reflectance(mesh), *REFLECTANCE)


def _reflectance(mesh: trimesh.Trimesh) -> np.ndarray:
    diffuse = getattr(getattr(mesh.visual, "material", None), "diffuse", None)
    return np.full(3, 0.5) if diffuse is None else np.asarray(diffuse, dtype=float)[:3] / 255.0


def pieces(folder: Path) -> list[Piece]:
    """Those of a room in all libraries of a folder, in the order of their names.

    Raises:
        SystemExit: the folder has no libraries.
    """
    libraries = sorted(folder.glob("*.sh3f"))
    if not libraries:
        raise SystemExit(f"{folder} has no furniture (*.sh3f); Debian: apt-get install sweethome3d-furniture")
    return [piece for library in libraries for piece in _of(library)]


def _of(library: Path) -> list[Piece]:
    with zipfile.ZipFile(library) as files:
        lines = files.read(CATALOGUE).decode("latin-1").splitlines()
        names = set(files.namelist())
    entries: dict[str, dict[str, str]] = {}
    for line in lines:
        key, found, value = line.partition("=")
        if found and "#" in key and not line.startswith("#"):
            name, _, number = key.partition("#")
            entries.setdefault(number, {})[name] = value.strip()
    return [
        Piece(library, entry["model"].lstrip("/"), _size(entry))
        for _, entry in sorted(entries.items(), key=lambda item: int(item[0]))
        if _stands_in_rooms(entry) and entry["model"].lstrip("/") in names
    ]


def _size(entry: Mapping[str, str]) -> np.ndarray:
    return np.array([float(entry[side]) for side in ("width", "depth", "height")]) / 100.0


def _stands_in_rooms(entry: Mapping[str, str]) -> bool:
    """Whether it stands on a floor, as it is in its file, and is as large as furniture."""
    if entry.get("category") not in CATEGORIES or entry.get("doorOrWindow") == "true" or "elevation" in entry:
        return False
    if entry.get("modelRotation", "1 0 0 0 1 0 0 0 1") != "1 0 0 0 1 0 0 0 1" or not entry["model"].endswith(".obj"):
        return False
    *sides, height = _size(entry)
    return SIDES[0] <= min(sides) and max(sides) <= SIDES[1] and HEIGHT[0] <= height <= HEIGHT[1]
