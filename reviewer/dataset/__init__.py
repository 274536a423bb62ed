"""Data sets: folder layouts, poses, occupancy maps, the importer, and the rendered demo world."""
