"""The frozen scene in other lights: of a file, of targets, drawn by chance, or swept."""
