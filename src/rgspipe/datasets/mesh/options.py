"""What a mesh from elsewhere leaves open. Nothing here loads torch, for the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.options import Options, option

#: Suffixes of meshes, and those of glTF.
GLTF = (".glb", ".gltf")
FORMATS = (".ply", ".obj", *GLTF)


@dataclass(frozen=True)
class MeshOptions(Options):
    """How a mesh stands among its photographs, whose cameras are read as `ScanOptions` say."""

    photographs: str | None = None
    """folder of the photographs and their cameras, in any layout of a capture; by default the mesh's own"""
    up: Literal["auto", "y", "z"] = "auto"
    """axis of the file that points up in the cameras' world, whose z is up; auto: y in glTF, as its specification has
    it, z elsewhere"""
    unit: float = option(1.0, low=1e-9, high=1e9)
    """units of the cameras' places, such as metres, of 1 in the mesh"""
