"""What a run has seen of a pair, changed by hand."""

from dataclasses import replace

from reviewer.masks import encode_rle
from reviewer.store.layers import load_alignment, put_alignment


def hide(store, run_id, pair_id, unseen):
    """Make the alignment of a pair say that these pixels, bool (H, W), cannot be compared."""
    told = replace(load_alignment(store, run_id, pair_id), valid=encode_rle(~unseen))
    store.write(lambda c: put_alignment(c, run_id, pair_id, told))
