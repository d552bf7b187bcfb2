"""Captures as other programs lay them out: cameras, photographs and measured depth, brought into our own layout."""
