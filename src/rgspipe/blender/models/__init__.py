"""The scenes that are modelled here, one file each.

A model has `build(parameters)`, which returns a Blender scene of surfaces alone, in the unit cube around the origin,
and `layout(parameters, space, resolution)`, which says where its cameras and lights are. `parameters` needs no bpy, nor
do `scene/models/`, which knows what is made of flat surfaces.
"""
