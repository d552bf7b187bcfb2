"""glTF files as their decoder reads them rightly: it rounds colours to bytes, drops what textures do beyond their ends,
finds nothing in a file without a scene, and leaves out what hangs on a camera."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rgspipe.datasets.mesh.links import GLB_HEADER, gltf_content
from rgspipe.scene.mesh import Numbers

#: The way of a texture beyond its ends that `Paint` has.
REPEAT = 10497


@dataclass(frozen=True)
class GltfMaterial:
    """What is read of a material.

    Attributes:
        colour: (3,) linear, in [0, 1].
        metallic: the part of the colour that is no diffuse reflectance. A file that neither states it nor has a
            texture for it is not taken for one of metal, as its specification has it: many exporters leave it out.
        repeats: whether its textures do, beyond their ends.
        opaque: whether nothing is seen through it.
    """

    colour: Numbers = field(default_factory=lambda: np.ones(3))
    metallic: float = 0.0
    repeats: bool = True
    opaque: bool = True


def numbered(path: Path) -> tuple[bytes, list[GltfMaterial]]:
    """A checked file whose materials have their numbers as names, and these materials.

    Colours of points that have no material get a white one, by which their decoder keeps them as they are. A file
    without scenes gets one of all that it has.
    """
    content = gltf_content(path)
    if not isinstance(content, dict):
        return path.read_bytes(), []
    nodes = content.get("nodes", [])
    below = {child for node in nodes for child in node.get("children", [])}
    if not content.get("scenes"):
        content["scenes"] = [{"nodes": [number for number in range(len(nodes)) if number not in below]}]
    for node in nodes:
        node.pop("camera", None)
    read = [_material(content, one) for one in content.get("materials", [])]
    primitives = [one for mesh in content.get("meshes", []) for one in mesh.get("primitives", [])]
    plain = [one for one in primitives if "COLOR_0" in one["attributes"] and "material" not in one]
    if plain:
        content.setdefault("materials", []).append({})
        read.append(GltfMaterial())
    for primitive in plain:
        primitive["material"] = len(read) - 1
    for number, material in enumerate(content.get("materials", [])):
        material["name"] = str(number)
    text = json.dumps(content).encode()
    return text if path.suffix.lower() == ".gltf" else _glb(path.read_bytes(), text), read


def _glb(content: bytes, text: bytes) -> bytes:
    """A GLB with another JSON."""
    text = text.ljust(-(-len(text) // 4) * 4)
    rest = content[GLB_HEADER + int.from_bytes(content[12:16], "little") :]
    length = GLB_HEADER + len(text) + len(rest)
    return b"".join(
        [content[:8], length.to_bytes(4, "little"), len(text).to_bytes(4, "little"), content[16:20], text, rest]
    )


def _material(content: dict, material: dict) -> GltfMaterial:
    given = material.get("pbrMetallicRoughness", {})
    colour = np.array(given.get("baseColorFactor", [1.0] * 4)[:3], np.float64)
    textures = [given[key] for key in ("baseColorTexture", "metallicRoughnessTexture") if given.get(key)]
    samplers = [content["textures"][one["index"]].get("sampler") for one in textures]
    ends = [content["samplers"][one].get(key) for one in samplers if one is not None for key in ("wrapS", "wrapT")]
    return GltfMaterial(
        colour,
        metallic=float(given.get("metallicFactor", bool(given.get("metallicRoughnessTexture")))),
        repeats=all(end in (None, REPEAT) for end in ends),
        opaque=material.get("alphaMode", "OPAQUE") == "OPAQUE",
    )
