"""Lamps that are in sight: found in images, kept out of what lights have to explain, and used to find the lights."""
