"""Models: arrays in, arrays out. No file of the data set, no database, no interface.

`interfaces` says what an aligner, a detector and a segmenter are; `registry` builds them by name.
"""
