"""What this machine can run, and whether its data is intact."""
