"""The store: one SQLite file, one writer thread, read connections for everybody else.

The only meeting place of importer, pipeline, app, evaluation and export. No model, no image pixels.
"""
