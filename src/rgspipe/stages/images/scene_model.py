"""From the configuration of a scene that Blender renders to its model's measures."""

from __future__ import annotations

import math

from rgspipe.blender.models.parameters import BlendFile, Model
from rgspipe.config.scene import CornellConfig, CornerConfig, SceneConfig
from rgspipe.errors import InputError
from rgspipe.scene.models import Box, CornellBox, Corridor, Vector


def scene_model(scene: SceneConfig) -> Model:
    """What Blender is to build or open.

    Raises:
        InputError: a material would reflect more light than it gets.
    """
    if scene.kind == "cornell":
        return _cornell_box(scene.cornell)
    if scene.kind == "corner":
        return _corridor(scene.corner)
    if scene.kind == "hotdog":
        return scene.hotdog
    if scene.kind == "room":
        return scene.room
    if scene.kind == "zoo":
        return scene.zoo
    return BlendFile(scene.path)


def _cornell_box(wanted: CornellConfig) -> CornellBox:
    """The room around the origin; the configuration measures from the front left corner of the floor.

    Raises:
        InputError: the boxes' colour and gloss together exceed 1.
    """
    reflected = max(wanted.box_color) + wanted.gloss
    if wanted.gloss > 0.0 and reflected > 1.0:
        raise InputError(
            "scene.cornell.gloss",
            expected="at most 1 together with the brightest channel of scene.cornell.box_color",
            found=f"{reflected:g}",
            remedy="Lower one of them.",
        )
    boxes = (
        _standing_box(wanted, wanted.tall_size, wanted.tall_center, wanted.tall_angle),
        _standing_box(wanted, wanted.short_size, wanted.short_center, wanted.short_angle),
    )
    return CornellBox(
        room=wanted.room,
        white=wanted.wall_color,
        left=wanted.left_color,
        right=wanted.right_color,
        boxes=boxes,
        gloss=wanted.gloss,
        shininess=wanted.shininess,
    )


def _standing_box(wanted: CornellConfig, size: Vector, foot: tuple[float, float], degrees: float) -> Box:
    width, depth, height = wanted.room
    center = (foot[0] - 0.5 * width, foot[1] - 0.5 * depth, 0.5 * (size[2] - height))
    return Box(center, size, math.radians(degrees), wanted.box_color)


def _corridor(wanted: CornerConfig) -> Corridor:
    return Corridor(
        width=wanted.width,
        height=wanted.height,
        wall=wanted.wall_color,
        floor=wanted.floor_color,
        near_end=wanted.near_end_color,
        far_end=wanted.far_end_color,
    )
