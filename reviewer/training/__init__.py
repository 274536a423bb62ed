"""Train a change detection net on synthetic pairs of reference images.

Reading order: settings -> selection (which reference images) -> stream (pairs as batches) ->
loop (one iteration after the other) -> session (a folder with checkpoints and log), curve.
"""
