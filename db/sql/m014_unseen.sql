ALTER TABLE alignments RENAME TO old_alignments;
DROP INDEX alignments_pair;
CREATE TABLE alignments (  -- reference -> live, of one run
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    flow BLOB NOT NULL,  -- zlib of int16 (h, w, 2): live pixel -> reference pixel, 1/32 pixel
    flow_stride INTEGER NOT NULL CHECK (flow_stride >= 1),  -- pixels between samples of flow and confidence
    valid_rle TEXT NOT NULL,  -- run-lengths of the live pixels that can be compared; the others are unseen
    valid_fraction REAL NOT NULL CHECK (valid_fraction BETWEEN 0 AND 1),  -- share of them
    residual_before REAL NOT NULL,  -- mean absolute grey difference unaligned, 0..255
    residual_after REAL NOT NULL,  -- the same after the warp, inside the valid pixels
    backward_px REAL,  -- median forward-backward error, pixels; NULL where there is no way back
    doubt TEXT NOT NULL DEFAULT '',  -- why it looks badly aligned, '' = it does not
    confidence BLOB,  -- grey PNG (h, w), 255 = the reference surely shows it; NULL where the aligner has none
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;
INSERT INTO alignments SELECT run_id, pair_id, flow, flow_stride, valid_rle, valid_fraction,
    residual_before, residual_after, backward_px, doubt, NULL FROM old_alignments;
DROP TABLE old_alignments;
CREATE INDEX alignments_pair ON alignments (pair_id);
