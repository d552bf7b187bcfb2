"""Measures, tables, pictures and the report. Reads no dataset and renders nothing."""
