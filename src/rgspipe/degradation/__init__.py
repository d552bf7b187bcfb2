"""Errors put into training views, fit targets and scene models on purpose, to measure what they cost."""
