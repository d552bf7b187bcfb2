"""Accuracy and time of this machine, and the path-traced truth that they are measured against."""
