"""From views of a scene with known lights to surfels that reproduce them."""
