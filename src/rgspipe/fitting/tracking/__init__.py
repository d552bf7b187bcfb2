"""Moving lights: a sequence of frames in, the lights of each frame out, with what their motion tells of them."""
