"""Meshes of other programs, and whether their files are what they claim."""
