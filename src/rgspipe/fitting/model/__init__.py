"""The image of unknown lights, and what it leaves unexplained: views and a target in, residuals and moments out.

How views see lights is one of the models of `renderer.images.model`; here are what a fit may move of a light, which
pixels it trusts, exposures and clipping.
"""
