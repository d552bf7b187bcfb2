"""A page in the browser that shows a frozen scene, in which lamps are moved and found: see `rgspipe.viewer.serve`."""
