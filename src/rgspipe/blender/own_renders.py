"""How renders of a user's .blend file differ from images of its surfaces: its render settings, scenes and layers."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

#: Diffuse bounces from which on even walls of albedo 0.8 lose little (0.8^17, 2 %).
ENOUGH_BOUNCES = 16


def differences(scene: bpy.types.Scene) -> list[str]:
    """Sentences about what makes renders of `scene`, as it is set, no measure of its lamps; none if nothing does."""
    found = [*_of_render(scene), *_of_linking(scene)]
    if scene.render.engine == "CYCLES":
        found += _of_cycles(scene.cycles)
    told = "renders of its own, as targets, are not what a lamp of rgspipe makes of it"
    return [*([f"{told}: {', '.join(found)}"] if found else []), *_curve(scene.view_settings.view_transform)]


def not_taken(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> list[str]:
    """Sentences about scenes and view layers of the open file other than those that are taken."""
    scenes = [one.name for one in bpy.data.scenes if one != scene and one.library is None]
    layers = [one.name for one in scene.view_layers if one != layer and one.use]
    others = (("scenes", scene, scenes), ("view layers", layer, layers))
    return [
        f'of its {what} "{taken.name}", which was open, is taken alone, not {_listed(rest)}'
        for what, taken, rest in others
        if rest
    ]


def _listed(names: list[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def _of_render(scene: bpy.types.Scene) -> Iterator[str]:
    render = scene.render
    if render.engine != "CYCLES":
        yield f"they are by {render.engine}, not CYCLES"
    region = (render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y)
    if render.use_border and region != (0.0, 0.0, 1.0, 1.0):
        yield "they are black outside of a render region"
    if render.use_motion_blur:
        yield "they have motion blur"
    if render.use_multiview:
        yield "they are stereoscopic"
    composited = scene.compositing_node_group if bpy.app.version >= (5, 0, 0) else scene.use_nodes
    if render.use_compositing and composited:
        yield "compositing nodes change them"
    editor = scene.sequence_editor
    if render.use_sequencer and editor is not None:
        strips = editor.strips_all if bpy.app.version >= (4, 4, 0) else editor.sequences_all
        if len(strips):
            yield "they are made of the sequencer's strips"


def _curve(view_transform: str) -> Iterator[str]:
    """Files of 8 bits are taken as sRGB, which is what this view transform makes."""
    if view_transform != "Standard":
        yield (
            f"PNGs and JPEGs of its renders, as targets, have the tone curve of {view_transform}, through which no "
            "lamp is found: save EXRs, or set the view transform to Standard"
        )


def _of_linking(scene: bpy.types.Scene) -> Iterator[str]:
    if bpy.app.version < (4, 0, 0):
        return
    linked = [
        item.name
        for item in scene.objects
        if item.light_linking.receiver_collection or item.light_linking.blocker_collection
    ]
    if linked:
        yield f"light linking keeps light of {_listed(sorted(linked))} from some objects"


def _of_cycles(cycles: bpy.types.PropertyGroup) -> Iterator[str]:
    if cycles.film_exposure != 1.0:
        yield f"they are {cycles.film_exposure:g} times as bright (exposure of the film)"
    bounces = min(cycles.max_bounces, cycles.diffuse_bounces)
    if bounces < ENOUGH_BOUNCES:
        yield f"light ends after {bounces} diffuse bounces"
    for what in ("direct", "indirect"):
        limit = getattr(cycles, f"sample_clamp_{what}")
        if limit > 0.0:
            yield f"{what} light is clamped at {limit:g}"
    if cycles.use_fast_gi:
        yield "global illumination is an approximation (Fast GI)"
    off = [kind for kind in ("reflective", "refractive") if not getattr(cycles, f"caustics_{kind}")]
    if off:
        yield f"{' and '.join(off)} caustics are off"
