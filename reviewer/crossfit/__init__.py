"""Detectors fitted to ground truth, so that every pair is judged by one that has not seen it."""
