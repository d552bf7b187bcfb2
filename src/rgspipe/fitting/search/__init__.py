"""Starts, and how they are refined: a problem and a dictionary in, refined and compared rigs of lights out."""
