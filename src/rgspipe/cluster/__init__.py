"""Sweeps on a Slurm cluster. Empty, as the options are imported at every start and submitit need not be."""
