"""The image of unknown lights, and what it leaves unexplained: views and a target in, residuals and moments out.

Views as pixels, as blocks of pixels, or with direct light where pixels look; exposures, clipping and gloss.
"""
