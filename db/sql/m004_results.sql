CREATE TABLE results (  -- which stages of a run have done a pair, and out of what
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    stage TEXT NOT NULL CHECK (stage IN ('align', 'detect', 'label', 'search', 'integrate')),  -- what was done
    key TEXT NOT NULL,  -- hash of inputs, settings and weights; "given:.." = not made by a model
    seconds REAL NOT NULL,  -- time of the stage, when it was made
    PRIMARY KEY (run_id, pair_id, stage)
) STRICT, WITHOUT ROWID;
CREATE INDEX results_key ON results (pair_id, stage, key);

INSERT INTO results SELECT run_id, pair_id, 'align', 'given:before', seconds FROM alignments;
INSERT INTO results SELECT run_id, pair_id, 'detect', 'given:before', seconds FROM detections;
INSERT INTO results SELECT run_id, pair_id, 'label', 'given:before', 0 FROM detections;
INSERT INTO results SELECT run_id, pair_id, 'search', 'given:before', seconds FROM searches;
-- No two runs share a result whose making is not known; regions are cheap, and are made again.
UPDATE results SET key = 'given:run ' || run_id || ' before keys';
INSERT INTO results SELECT run_id, pair_id, 'integrate', 'before keys', 0 FROM predictions
    WHERE method = 'doi';

ALTER TABLE alignments RENAME TO old_alignments;
DROP INDEX alignments_pair;
CREATE TABLE alignments (  -- reference -> live, of one run
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    flow BLOB NOT NULL,  -- zlib of int16 (h, w, 2): live pixel -> reference pixel, 1/32 pixel
    flow_stride INTEGER NOT NULL CHECK (flow_stride >= 1),  -- pixels between flow samples
    valid_rle TEXT NOT NULL,  -- run-lengths of the live pixels the warp reaches
    valid_fraction REAL NOT NULL CHECK (valid_fraction BETWEEN 0 AND 1),  -- share of them
    residual_before REAL NOT NULL,  -- mean absolute grey difference unaligned, 0..255
    residual_after REAL NOT NULL,  -- the same after the warp, inside the valid pixels
    backward_px REAL,  -- median forward-backward error, pixels; NULL where there is no way back
    doubt TEXT NOT NULL DEFAULT '',  -- why it looks badly aligned, '' = it does not
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;
INSERT INTO alignments SELECT run_id, pair_id, flow, flow_stride, valid_rle, valid_fraction,
    residual_before, residual_after, NULL, '' FROM old_alignments;
DROP TABLE old_alignments;
CREATE INDEX alignments_pair ON alignments (pair_id);

ALTER TABLE detections RENAME TO old_detections;
DROP INDEX detections_pair;
CREATE TABLE detections (  -- M_o, the detector's change mask
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    probability BLOB,  -- grey PNG, 255 = certainly changed; NULL when only a mask was imported
    threshold REAL NOT NULL CHECK (threshold BETWEEN 0 AND 1),  -- changed where probability >{MASK}
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;
INSERT INTO detections SELECT run_id, pair_id, probability, threshold, height, width, rle, area,
    box_x, box_y, box_width, box_height FROM old_detections;
DROP TABLE old_detections;
CREATE INDEX detections_pair ON detections (pair_id);

DROP TABLE searches;

ALTER TABLE failures RENAME TO old_failures;
CREATE TABLE failures (  -- pairs that a stage could not do
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    stage TEXT NOT NULL CHECK (stage IN ('align', 'detect', 'label', 'search', 'integrate')),  -- where
    message TEXT NOT NULL,  -- what went wrong
    created_at TEXT NOT NULL,  -- UTC, ISO 8601
    PRIMARY KEY (run_id, pair_id, stage)
) STRICT, WITHOUT ROWID;
INSERT INTO failures SELECT * FROM old_failures;
DROP TABLE old_failures;

CREATE TABLE labels (  -- what a labeller, or a person, calls what has changed
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    number INTEGER NOT NULL CHECK (number >= 0),  -- 0, 1, 2 .. within run and pair
    component INTEGER,  -- component of M_o that was shown, NULL = the whole mask
    raw TEXT NOT NULL,  -- what the labeller said, word for word
    label TEXT NOT NULL,  -- what is searched for; '' = nothing
    note TEXT NOT NULL,  -- why the label is empty, '' = it is not
    annotator_id INTEGER REFERENCES annotators (id),  -- who edited it, NULL = nobody
    edited_at TEXT,  -- UTC, ISO 8601, NULL = never
    PRIMARY KEY (run_id, pair_id, number)
) STRICT, WITHOUT ROWID;
CREATE INDEX labels_pair ON labels (pair_id);

UPDATE runs SET settings = json_set(settings, '$.labeller', 'none');
