"""What a user's .blend file holds that no surfel can be, and what leaving it out costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

import bpy

from rgspipe.blender.rendered import Surface

#: Nodes that let light through, and those that mirror.
CLEAR = {"BSDF_GLASS", "BSDF_REFRACTION", "BSDF_TRANSPARENT", "BSDF_TRANSLUCENT", "BSDF_RAY_PORTAL"}
MIRRORING = {"BSDF_GLOSSY", "BSDF_METALLIC", "BSDF_ANISOTROPIC"}

#: Inputs that all have to be above 0 for a surface to glow.
GLOWING = {"EMISSION": ("Strength", "Color"), "BSDF_PRINCIPLED": ("Emission Strength", "Emission Color")}

#: What inputs were called before Blender 4.
FORMERLY = {"Emission Color": "Emission", "Transmission Weight": "Transmission"}

#: Types of grease pencil, which Blender draws over images.
DRAWINGS = {"GPENCIL", "GREASEPENCIL"}

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
    override = layer.material_override
    used = [override] if override else _by_name({material for one in surfaces for material in one.materials})
    items = _by_name({one.item for one in surfaces})
    found = {what: _listed([one for one in used if _has(one, test)]) for what, test in TESTS.items()}
    sentences = [_lamps(scene), _world(scene)]
    sentences += [f"{what} of {names} {COSTS[what]}" for what, names in found.items() if names]
    treated = {what: _listed([one for one in items if test(one, layer)]) for what, test in TREATED.items()}
    sentences += [f"{what} of {names} is left out: {ORDINARY}" for what, names in treated.items() if names]
    sentences += _other_objects(scene)
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


def _other_objects(scene: bpy.types.Scene) -> list[str]:
    kinds = {"VOLUME": "volumes", "CURVES": "hair", "POINTCLOUD": "point clouds"}
    shown = [item for item in scene.objects if not item.hide_render]
    count = Counter(kinds[item.type] for item in shown if item.type in kinds)
    count["hair"] += sum(
        system.settings.type == "HAIR" and system.settings.render_type == "PATH"
        for item in shown
        for system in item.particle_systems
    )
    listed = ", ".join(f"{kind}: {number}" for kind, number in sorted(count.items()) if number)
    drawings = sum(item.type in DRAWINGS for item in shown)
    found = {
        f"objects without faces ({listed}) are in the images, but cameras and lamps are placed as if they were not, "
        "and no model has fog": listed,
        f"drawings ({drawings}) are left out: they are in no image": drawings,
    }
    return [sentence for sentence, there in found.items() if there]


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


def _cuts(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(node.type == "HOLDOUT" for node in reached(tree))


def _scripted(tree: bpy.types.ShaderNodeTree) -> bool:
    return any(node.type == "SCRIPT" for node in reached(tree))


def _ends_in(tree: bpy.types.ShaderNodeTree, name: str) -> bool:
    """Whether something is linked to this input of a material."""
    outputs = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output]
    return any(node.inputs[name].is_linked for node in outputs)


#: What a material may be besides a diffuse surface, and what comes of it.
TESTS: dict[str, Test] = {
    "light": _glows,
    "glass": _clear,
    "metal": _mirrors,
    "fog": _scatters,
    "holdout": _cuts,
    "script": _scripted,
}
COSTS = {
    "light": "is left out: nothing glows",
    "glass": "is in the images, but a surfel lets no light through: what is seen through it, and the light that "
    "falls through it, is taken for its own colour, and a lamp behind it is not found",
    "metal": "is in the images, but surfels are diffuse (training with gloss finds broad highlights): what it mirrors "
    "is taken for its own colour",
    "fog": "is in the images, but no model has any: surfaces behind it are taken for paler or darker than they are",
    "holdout": "is a hole in the images, and a surface to light: no surfel is so",
    "script": "is left out: Open Shading Language is off, and what its nodes make is 0",
}


#: What a render may do with an object besides showing it, and what is done instead.
TREATED: dict[str, Callable[[bpy.types.Object, bpy.types.ViewLayer], bool]] = {
    "invisibility to some rays": lambda item, layer: (
        item.indirect_only_get(view_layer=layer) or not all(getattr(item, f"visible_{ray}") for ray in RAYS)
    ),
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
    socket = node.inputs.get(name) or node.inputs.get(FORMERLY.get(name, name))
    if socket is None:
        return False
    value = socket.default_value
    return socket.is_linked or (value > 0.0 if isinstance(value, float) else max(value[:3]) > 0.0)


def _below_one(node: bpy.types.Node, name: str) -> bool:
    """Whether an input may be below 1: it is, or something is linked to it."""
    socket = node.inputs.get(name)
    return socket is not None and (socket.is_linked or socket.default_value < 1.0)
