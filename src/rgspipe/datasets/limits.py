"""What no scene has: numbers beyond which float32 loses its squares, so that answers would be silently wrong."""

from __future__ import annotations

#: The largest coordinate, or size of a surfel, scene units: even a place on Earth is nearer to its centre, in
#: millimetres.
FARTHEST = 1e10

#: The largest intensity of a light, W/sr or W.
STRONGEST = 1e18

#: The largest number in a tensor file.
LARGEST = 1e18

#: Albedo may exceed 1, and a mask its range, by this: the rounding of files.
ROUNDING = 1e-3
