"""Surfels in PLY files: of other programs, of viewers, and our own."""
