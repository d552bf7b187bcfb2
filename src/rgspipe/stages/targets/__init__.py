"""Fit targets: images under unknown lights whose truth is known, made of single lights that are rendered once."""
