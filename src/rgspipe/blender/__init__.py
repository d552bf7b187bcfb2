"""Blender and Cycles: the only code that imports bpy, and it does so in a process of its own.

`process.render_dataset` and `process.render_room` are the ways in; they, `job` and `room_job` import without
bpy. The modules that `__main__` runs inside that process are `cornell`, `blend`, `room`, `geometry`, `cameras`,
`targets`, `plan`, `cycles` and `passes`.
"""
