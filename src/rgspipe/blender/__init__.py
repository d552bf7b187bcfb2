"""Blender and Cycles: the only code that imports bpy, and it does so in a process of its own.

`process.render_dataset` is the way in; it and `job` import without bpy. The modules that `__main__`
runs inside that process are `cornell`, `blend`, `geometry`, `cameras`, `targets`, `plan`, `cycles`
and `passes`.
"""
