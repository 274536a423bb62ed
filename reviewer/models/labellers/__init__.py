"""Labellers: they name what has changed, so that a segmenter can search for it."""
