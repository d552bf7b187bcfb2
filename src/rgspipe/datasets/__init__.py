"""The file formats: datasets, images, light files. What they load is plain data (views.py).

Nothing is imported here, so that a process which only writes images need not load torch.
"""
