"""Typed read access for scripts and notebooks: `reviewer.open(path)`."""
