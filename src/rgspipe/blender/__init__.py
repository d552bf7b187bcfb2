"""Blender and Cycles: the only code that imports bpy, and it does so in a process of its own.

`process.render_dataset` and `process.render_room` are the ways in; they, `job`, `room_job`, `fixed_view`, `targets`,
`models.parameters` import without bpy. All other modules here are run by `__main__` inside that
process.
"""
