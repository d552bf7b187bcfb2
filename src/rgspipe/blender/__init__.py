"""Blender and Cycles: the only code that imports bpy, and it does so in a process of its own.

`render_dataset`, `render_room` and `pool.render_pool` are the ways in; they, what they import at their top, and
`fixed_view`, `targets` and `models.parameters` import without bpy.
"""
