"""Segmenters: object masks on the live and on the reference image, both in the live frame."""
