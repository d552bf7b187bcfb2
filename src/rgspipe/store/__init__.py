"""What stays on the disk: files that are whole or not there, artifacts with what they were made from, what is kept."""
