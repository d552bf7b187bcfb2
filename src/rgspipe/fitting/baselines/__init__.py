"""The published method, as it is written: a problem in, lights out."""
