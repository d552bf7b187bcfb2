"""What a user's .blend file holds that no surfel can be, and what leaving it out costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

import bpy
import numpy as np
from mathutils import Matrix

from rgspipe.blender.rendered import Surface

#: Nodes that let light through, and those that mirror.
CLEAR = {"BSDF_GLASS", "BSDF_REFRACTION", "BSDF_TRANSPARENT", "BSDF_TRANSLUCENT", "BSDF_RAY_PORTAL"}
MIRRORING = {"BSDF_GLOSSY", "BSDF_METALLIC", "BSDF_ANISOTROPIC"}

#: Inputs that all have to be above 0 for a surface to glow.
GLOWING = {"EMISSION": ("Strength", "Color"), "BSDF_PRINCIPLED": ("Emission Strength", "Emission Color")}

#: Outputs by which a material knows its object, or where it is, by the type of the node.
POSED = {"TEX_COORD": ("Object",), "NEW_GEOMETRY": ("Position",), "OBJECT_INFO": ("Location", "Color", "Random")}

#: Textures that go by the box around an object where nothing says by what.
BOXED = {"TEX_BRICK", "TEX_CHECKER", "TEX_GABOR", "TEX_GRADIENT", "TEX_MAGIC", "TEX_NOISE", "TEX_VORONOI", "TEX_WAVE"}

#: A pose whose axes are off by less, in its largest scale, turns nothing.
STRAIGHT = 1e-4

#: Names of materials or objects that a sentence lists.
LISTED = 4

#: Kinds of rays that an object may be invisible to; to those of fog it matters nothing, as no model has any.
RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")

Block = TypeVar("Block", bound=bpy.types.ID)
Test = Callable[[bpy.types.ShaderNodeTree], bool]


def left_out(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, surfaces: Sequence[Surface]) -> list[str]:
    """Sentences about the open file as it is, one a subject.

    Args:
        scene, layer: what is rendered of it.
        surfaces: the same.
    """
    used = _by_name({material for one in surfaces for material in one.mesh.materials if material is not None})
    items = _by_name({one.item for one in surfaces})
    turned = {material for one in surfaces if _turned(one.pose) for material in one.mesh.materials}
    found = {what: _listed([one for one in used if _has(one, test)]) for what, test in TESTS.items()}
    found["pattern"] = _listed([one for one in used if _has(one, _posed) or (one in turned and _has(one, _boxed))])
    found["relief"] = _listed([one for one in used if _moves(one) and _has(one, _displaced)])
    sentences = [_lamps(scene), _world(scene), _override(layer)]
    sentences += [f"{what} of {names} {COSTS[what]}" for what, names in found.items() if names]
    treated = {what: _listed([one for one in items if test(one, layer)]) for what, test in TREATED.items()}
    sentences += [f"{what} of {names} is left out: {ORDINARY}" for what, names in treated.items() if names]
    sentences.append(_other_objects(scene))
    return [sentence for sentence in sentences if sentence]


def _lamps(scene: bpy.types.Scene) -> str:
    kinds = Counter(item.data.type.lower() for item in scene.objects if item.type == "LIGHT" and not item.hide_render)
    if not kinds:
        return ""
    listed = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    return f"light of its lamps ({listed}) is left out: a point light of our own is all that shines in each image"


def _world(scene: bpy.types.Scene) -> str:
    tree = None if scene.world is None else scene.world.node_tree
    shines = tree is not None and any(
        node.type == "BACKGROUND" and _above_zero(node, "Strength") and _above_zero(node, "Color")
        for node in reached(tree)
    )
    return "light of its world is left out: what is around the scene is black" if shines else ""


def _override(layer: bpy.types.ViewLayer) -> str:
    material = layer.material_override
    return "" if material is None else f'"{material.name}", the material of all in its view layer, is left out'


def _other_objects(scene: bpy.types.Scene) -> str:
    kinds = {"VOLUME": "volumes", "CURVES": "hair", "POINTCLOUD": "point clouds"}
    count = Counter(kinds[item.type] for item in scene.objects if item.type in kinds and not item.hide_render)
    if not count:
        return ""
    listed = ", ".join(f"{kind}: {number}" for kind, number in sorted(count.items()))
    return f"objects that are no surfaces ({listed}) are left out: they are in no image"


def _by_name(blocks: Iterable[Block]) -> list[Block]:
    return sorted(blocks, key=lambda block: block.name_full)


def _listed(blocks: Sequence[bpy.types.ID]) -> str:
    """The names of some of them; empty for none."""
    more = [f"{len(blocks) - LISTED} more"] if len(blocks) > LISTED else []
    return ", ".join([*(f'"{block.name}"' for block in blocks[:LISTED]), *more])


def _has(material: bpy.types.Material, test: Test) -> bool:
    return material.node_tree is not None and test(material.node_tree)


def _glows(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(
        node.type in GLOWING and all(_above_zero(node, name) for name in GLOWING[node.type]) for node in reached(tree)
    )


def _clear(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(
        node.type in CLEAR
        or (node.type == "BSDF_PRINCIPLED" and (_above_zero(node, "Transmission Weight") or _below_one(node, "Alpha")))
        for node in reached(tree)
    )


def _mirrors(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(
        node.type in MIRRORING or (node.type == "BSDF_PRINCIPLED" and _above_zero(node, "Metallic"))
        for node in reached(tree)
    )


def _scatters(tree: bpy.types.ShaderNodeTree) -> bool:
    return _ends_in(tree, "Volume")


def _posed(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(node.outputs[name].is_linked for node in reached(tree) for name in POSED.get(node.type, ()))


def _boxed(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(
        (node.type == "TEX_COORD" and node.outputs["Generated"].is_linked)
        or (node.type in BOXED and not node.inputs["Vector"].is_linked)
        for node in reached(tree)
    )


def _turned(pose: Matrix) -> bool:
    """Whether the box around a surface is another one in the scene than in its object; mirrored in x it is the same."""
    axes = np.array(pose.to_3x3())
    axes[0] *= np.sign(np.linalg.det(axes))
    scales = np.diag(axes)
    return bool(scales.min() <= 0.0 or np.abs(axes - np.diag(scales)).max() > STRAIGHT * scales.max())


def _displaced(tree: bpy.types.ShaderNodeTree) -> bool:
    return _ends_in(tree, "Displacement")


def _moves(material: bpy.types.Material) -> bool:
    """Whether displacement moves surfaces, and not their normals alone."""
    held_by = material.cycles if bpy.app.version < (4, 1, 0) else material
    return held_by.displacement_method != "BUMP"


def _ends_in(tree: bpy.types.ShaderNodeTree, name: str) -> bool:
    """Whether something is linked to this input of a material."""
    outputs = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output]
    return any(node.inputs[name].is_linked for node in outputs)


#: What a material may be besides a diffuse surface, and what comes of it.
TESTS: dict[str, Test] = {"light": _glows, "glass": _clear, "metal": _mirrors, "fog": _scatters}
COSTS = {
    "light": "is left out: nothing glows",
    "glass": "is in the images, but a surfel lets no light through: what is seen through it, and the light that "
    "falls through it, is taken for its own colour, and a lamp behind it is not found",
    "metal": "is in the images, but surfels are diffuse (training with gloss finds broad highlights): what it mirrors "
    "is taken for its own colour",
    "fog": "is in the images, but no model has any: surfaces behind it are taken for paler or darker than they are",
    "pattern": "is another one in the images than in the file: it goes by its object (the pose, a number or a "
    "colour), and each surface is an object of its own, in a scene scaled into a cube of 1",
    "relief": "is higher or lower in the images than in the file: displacement has a length, and surfaces are scaled "
    "into a cube of 1",
}


#: What a render may do with an object besides showing it, and what is done instead.
TREATED: dict[str, Callable[[bpy.types.Object, bpy.types.ViewLayer], bool]] = {
    "invisibility to some rays": lambda item, layer: not all(getattr(item, f"visible_{ray}") for ray in RAYS),
    "the holdout": lambda item, layer: item.is_holdout or item.holdout_get(view_layer=layer),
    "the shadow catcher": lambda item, layer: item.is_shadow_catcher,
}
ORDINARY = "it is a surface like any other, in all images"


def reached(tree: bpy.types.ShaderNodeTree) -> Iterator[bpy.types.Node]:
    """The nodes that lead to an output of a tree, those of groups included."""
    outputs = {"OUTPUT_MATERIAL", "OUTPUT_WORLD", "GROUP_OUTPUT"}
    waiting = [node for node in tree.nodes if node.type in outputs and getattr(node, "is_active_output", True)]
    seen = set()
    while waiting:
        node = waiting.pop()
        if node.name in seen:
            continue
        seen.add(node.name)
        yield node
        if node.type == "GROUP" and node.node_tree is not None:
            yield from reached(node.node_tree)
        waiting += [link.from_node for socket in node.inputs for link in socket.links]


def _above_zero(node: bpy.types.Node, name: str) -> bool:
    """Whether an input may be above 0: it is, or something is linked to it."""
    socket = node.inputs.get(name)
    if socket is None:
        return False
    value = socket.default_value
    return socket.is_linked or (value > 0.0 if isinstance(value, float) else max(value[:3]) > 0.0)


def _below_one(node: bpy.types.Node, name: str) -> bool:
    """Whether an input may be below 1: it is, or something is linked to it."""
    socket = node.inputs.get(name)
    return socket is not None and (socket.is_linked or socket.default_value < 1.0)
