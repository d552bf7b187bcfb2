"""Scenes of another maker, photographed by other people's renderers: nothing of rgspipe is imported here.

`rooms.py` draws a scene from a seed, of the shapes in `shapes.py` and the furniture that `furniture.py` finds. A
`Shot` (`cameras.py`) of it is photographed by Mitsuba, Radiance or LuxCore (`by_mitsuba.py` and so on): each is a
function of shapes, shot, lamp, its intensity, the number of paths a pixel and a seed. Lengths are metres, +z is up.
"""
