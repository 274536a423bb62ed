"""Build, review and audit change-detection ground truth on reference/live image pairs."""

__version__ = "0.1.0"
