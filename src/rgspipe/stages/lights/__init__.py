"""The lights of targets: found in single images, or followed through a sequence."""
