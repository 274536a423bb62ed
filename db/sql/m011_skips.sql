ALTER TABLE detections RENAME TO old_detections;
DROP INDEX detections_pair;
CREATE TABLE detections (  -- M_o, the detector's change mask
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    probability BLOB,  -- grey PNG, 255 = certainly changed; NULL when only a mask was imported
    threshold REAL NOT NULL CHECK (threshold BETWEEN 0 AND 1),  -- changed where probability >{MASK}
    doubt TEXT NOT NULL DEFAULT '',  -- why it looks as if nothing could be compared, '' = it does not
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;
INSERT INTO detections SELECT run_id, pair_id, probability, threshold, height, width, rle, area,
    box_x, box_y, box_width, box_height, '' FROM old_detections;
DROP TABLE old_detections;
CREATE INDEX detections_pair ON detections (pair_id);

-- Older results are judged by what was kept of them, as new ones are (reviewer.pipeline.judging).
UPDATE detections SET doubt = printf('%.0f%% of the picture is called changed',
    100.0 * area / (height * width)) WHERE area > 0.15 * height * width;
UPDATE alignments SET doubt = trim(doubt || printf('; forward-backward error %.1f px', backward_px),
    '; ') WHERE backward_px > 1 AND instr(doubt, 'forward-backward') = 0;

CREATE TABLE withdrawals (  -- verdicts that were taken back, or given again; append-only
    id INTEGER PRIMARY KEY,  -- key
    audit_id INTEGER NOT NULL REFERENCES audits (id) ON DELETE CASCADE,  -- the verdict
    withdrawn INTEGER NOT NULL CHECK (withdrawn IN (0, 1)),  -- 1 = taken back, 0 = given again
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- who
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;
CREATE INDEX withdrawals_audit ON withdrawals (audit_id, id);

CREATE TRIGGER withdrawals_stay BEFORE UPDATE ON withdrawals
BEGIN SELECT RAISE (ABORT, 'withdrawals are append-only'); END;

CREATE TRIGGER withdrawals_last BEFORE DELETE ON withdrawals
BEGIN SELECT RAISE (ABORT, 'withdrawals are append-only'); END;

CREATE VIEW standing_audits AS  -- the verdicts that were not taken back
SELECT a.* FROM audits a WHERE NOT coalesce((SELECT w.withdrawn FROM withdrawals w
    WHERE w.audit_id = a.id ORDER BY w.id DESC LIMIT 1), 0);

DROP VIEW doi_decisions;
CREATE VIEW doi_decisions AS  -- one row a region, with the newest verdict that stands
SELECT g.id AS region_id, r.name AS run, sp.name AS split, p.name AS pair, g.number,
    g.overlap_px, g.f_b, g.iou, g.doi, g.choice, g.inspect, g.reason,
    (SELECT group_concat(DISTINCT o.label) FROM objects o, json_each(g.objects) j
        WHERE o.run_id = g.run_id AND o.pair_id = g.pair_id AND o.side = 'live'
        AND o.number = j.value) AS labels,
    a.verdict, n.name AS annotator, a.reason AS verdict_reason, a.comment,
    a.created_at AS audited_at
FROM regions g
JOIN runs r ON r.id = g.run_id
JOIN pairs p ON p.id = g.pair_id
JOIN splits sp ON sp.id = p.split_id
LEFT JOIN audits a ON a.id = (SELECT max(b.id) FROM standing_audits b WHERE b.region_id = g.id)
LEFT JOIN annotators n ON n.id = a.annotator_id;

DROP VIEW opinions;
CREATE VIEW opinions AS  -- what each person said last of a region and stands by, and its outcome
SELECT a.region_id, g.run_id, g.pair_id, n.name AS annotator, a.annotator_id, a.verdict,
    coalesce(nullif(a.verdict, 'agree'), g.choice) AS outcome, a.reason, a.comment, a.created_at
FROM standing_audits a
JOIN regions g ON g.id = a.region_id
JOIN annotators n ON n.id = a.annotator_id
WHERE a.id = (SELECT max(b.id) FROM standing_audits b
    WHERE b.region_id = a.region_id AND b.annotator_id = a.annotator_id);

CREATE TABLE skips (  -- pairs that cannot be compared: left out of exports and scores
    pair_id INTEGER PRIMARY KEY REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- who said so
    reason TEXT NOT NULL,  -- why
    audits TEXT NOT NULL CHECK (json_valid(audits)),  -- JSON list: rejections that came with it
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;
