"""Errors put into targets and models on purpose, to measure what they cost a fit."""
