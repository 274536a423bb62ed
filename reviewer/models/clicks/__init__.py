"""Click segmenters: find the object under clicks, and what they keep between clicks."""
