"""What accuracy costs: rooms with exact geometry, path-traced truth, other renderers, and the front between them."""
