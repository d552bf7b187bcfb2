"""The image of a light: what pixels of a frozen scene, or blocks of them, see of one of unit intensity.

Three models have one interface, unit lights in, unit images with derivatives out: `SurfelModel` (soft: direct light at
surfels' centres, in model.py), `PixelModel` (sharp: direct light where pixels look, in pixels.py) and `BlockModel`
(averages over blocks of pixels, in blocks.py).
"""
