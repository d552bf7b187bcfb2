"""Node trees of what has one."""

from __future__ import annotations

import bpy


def tree_of(item: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """The nodes of a material or a world, which Blender 5 always uses and older ones must be told to."""
    if bpy.app.version < (5, 0, 0):
        item.use_nodes = True
    return item.node_tree
