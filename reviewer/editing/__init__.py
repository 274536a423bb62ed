"""Changes that people make: a mask committed on a revision, a verdict that the mask follows."""
