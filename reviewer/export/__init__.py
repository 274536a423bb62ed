"""Ground truth as files for training and evaluation elsewhere; masks never change on the way."""
