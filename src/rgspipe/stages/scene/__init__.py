"""From images or files to surfels, and from surfels to the frozen scene that fits need."""
