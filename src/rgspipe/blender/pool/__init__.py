"""One light at a time: pools of single lights that Blender renders, and fit targets that are sums of them.

Light is linear, so the image of a rig is the sum of its lights' images, each times its RGB intensity. A pool is
rendered once; any number of rigs of one, two or more lights follow from it, their true lights known exactly.

`render_pool` is the way in to Blender; `plan` and `cameras` run in its process, all other modules import without bpy.
"""
