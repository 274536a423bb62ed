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

-- What a run has not seen is left out of its counts: all of them are made again when somebody asks.
DROP VIEW split_scores;
DROP VIEW pair_scores;
DROP TABLE scores;
DELETE FROM pair_terms;
DELETE FROM region_outcomes;

CREATE TABLE scores (  -- pixel counts of a prediction against one mask revision
    run_id INTEGER NOT NULL,  -- its run
    pair_id INTEGER NOT NULL,  -- its pair
    method TEXT NOT NULL,  -- method of the prediction
    revision INTEGER NOT NULL,  -- number of the mask revision that was the truth
    tp INTEGER NOT NULL CHECK (tp >= 0),  -- changed, and found
    fp INTEGER NOT NULL CHECK (fp >= 0),  -- found, but not changed
    fn INTEGER NOT NULL CHECK (fn >= 0),  -- changed, but not found
    tn INTEGER NOT NULL CHECK (tn >= 0),  -- neither
    ignored INTEGER NOT NULL CHECK (ignored >= 0),  -- pixels left out because they are ill-posed
    unseen_px INTEGER NOT NULL CHECK (unseen_px >= 0),  -- other pixels left out because the run has not seen them
    unseen_objects INTEGER NOT NULL CHECK (unseen_objects >= 0),  -- changed objects that lie in these as a whole
    PRIMARY KEY (run_id, pair_id, method),
    FOREIGN KEY (run_id, pair_id, method)
        REFERENCES predictions (run_id, pair_id, method) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TRIGGER alignments_recount AFTER INSERT ON alignments
BEGIN
    DELETE FROM scores WHERE run_id = NEW.run_id AND pair_id = NEW.pair_id;
    DELETE FROM pair_terms WHERE run_id = NEW.run_id AND pair_id = NEW.pair_id;
END;

CREATE VIEW pair_scores AS  -- counts and scores per run, method and pair; no stale counts, no skipped pairs; `unseen` is a share
SELECT r.name AS run, s.method, sp.name AS split, p.name AS pair, s.run_id, s.pair_id,
    s.tp, s.fp, s.fn, s.tn, s.ignored, s.revision, t.standing,
    CASE WHEN s.tp + s.fp THEN 1.0 * s.tp / (s.tp + s.fp) ELSE 0.0 END AS precision,
    CASE WHEN s.tp + s.fn THEN 1.0 * s.tp / (s.tp + s.fn) ELSE 0.0 END AS recall,
    CASE WHEN 2 * s.tp + s.fp + s.fn
        THEN 2.0 * s.tp / (2 * s.tp + s.fp + s.fn) ELSE 0.0 END AS f_score,
    s.unseen_px, s.unseen_objects,
    CASE WHEN s.tp + s.fp + s.fn + s.tn + s.unseen_px
        THEN 1.0 * s.unseen_px / (s.tp + s.fp + s.fn + s.tn + s.unseen_px) ELSE 0.0 END AS unseen
FROM scores s
JOIN runs r ON r.id = s.run_id
JOIN pairs p ON p.id = s.pair_id
JOIN splits sp ON sp.id = p.split_id
JOIN ground_truth t ON t.pair_id = s.pair_id AND t.number = s.revision
WHERE s.pair_id NOT IN (SELECT pair_id FROM skips);

CREATE VIEW split_scores AS  -- pooled pixels inside a split: the paper's protocol; `unseen` is a share
SELECT run, method, split, count(*) AS pairs,
    sum(tp) AS tp, sum(fp) AS fp, sum(fn) AS fn, sum(tn) AS tn, sum(ignored) AS ignored,
    CASE WHEN sum(tp) + sum(fp) THEN 1.0 * sum(tp) / (sum(tp) + sum(fp)) ELSE 0.0 END AS precision,
    CASE WHEN sum(tp) + sum(fn) THEN 1.0 * sum(tp) / (sum(tp) + sum(fn)) ELSE 0.0 END AS recall,
    CASE WHEN 2 * sum(tp) + sum(fp) + sum(fn)
        THEN 2.0 * sum(tp) / (2 * sum(tp) + sum(fp) + sum(fn)) ELSE 0.0 END AS f_score,
    sum(unseen_px) AS unseen_px, sum(unseen_objects) AS unseen_objects,
    CASE WHEN sum(tp + fp + fn + tn + unseen_px)
        THEN 1.0 * sum(unseen_px) / sum(tp + fp + fn + tn + unseen_px) ELSE 0.0 END AS unseen
FROM pair_scores GROUP BY run, method, split;
