"""From stored predictions and ground truth to counts, scores and tables."""
