"""Labellers: what to call that which has changed, so that a segmenter can search for it."""
