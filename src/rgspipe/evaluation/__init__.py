"""Measures, tables, pictures and figures of scenes and fits.

What is measured is rendered or fitted for it here; datasets are read by those who ask.
"""
