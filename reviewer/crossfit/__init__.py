"""Detectors fitted to ground truth; every pair is judged by one not trained on it."""
