"""Where images come from: scenes that Blender renders, datasets, captures of other programs; and if they are right."""
