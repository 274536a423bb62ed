"""Viser's panels beside the workbench: queue, map, found, plan, scores, what if."""
