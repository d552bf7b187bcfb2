"""Measures, tables, pictures and figures. Reads no dataset and renders nothing."""
