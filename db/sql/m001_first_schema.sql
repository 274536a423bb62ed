CREATE TABLE maps (  -- occupancy grids in ROS map_server form
    id INTEGER PRIMARY KEY,  -- key
    path TEXT NOT NULL UNIQUE,  -- grey image of the grid, relative to the database's folder
    sha256 TEXT NOT NULL CHECK (length(sha256) = 64),  -- hash of that file
    resolution REAL NOT NULL CHECK (resolution > 0),  -- metres per cell
    height INTEGER NOT NULL CHECK (height > 0),  -- cells
    width INTEGER NOT NULL CHECK (width > 0),  -- cells
    origin_x REAL NOT NULL,  -- world x of the lower left corner, metres
    origin_y REAL NOT NULL,  -- world y of the lower left corner, metres
    origin_theta REAL NOT NULL  -- rotation of the grid, radians
) STRICT;

CREATE TABLE splits (  -- one workspace x object group, such as cs1
    id INTEGER PRIMARY KEY,  -- key
    name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),  -- cs1 .. hw3 in the paper
    workspace TEXT,  -- cs, cr, lr, hw; NULL when the name does not tell
    object_group INTEGER,  -- 1, 2, 3; NULL when the name does not tell
    layout TEXT NOT NULL,  -- layout it was imported from
    map_id INTEGER REFERENCES maps (id),  -- its occupancy grid, if any
    imported_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;

CREATE TABLE images (  -- an image file on disk
    id INTEGER PRIMARY KEY,  -- key
    split_id INTEGER NOT NULL REFERENCES splits (id) ON DELETE CASCADE,  -- its split
    session TEXT NOT NULL CHECK (session IN ('reference', 'live')),  -- which drive took it
    name TEXT NOT NULL,  -- file name without extension
    path TEXT NOT NULL,  -- relative to the database's folder
    sha256 TEXT NOT NULL CHECK (length(sha256) = 64),  -- hash of the file
    height INTEGER NOT NULL CHECK (height > 0),  -- pixels
    width INTEGER NOT NULL CHECK (width > 0),  -- pixels
    stamp REAL,  -- seconds, NULL without poses
    x REAL,  -- viewpoint in the map, metres, NULL without poses
    y REAL,  -- viewpoint in the map, metres, NULL without poses
    theta REAL,  -- heading, radians, NULL without poses
    UNIQUE (split_id, session, name)
) STRICT;

CREATE TABLE pairs (  -- a live image and the reference image of the closest viewpoint
    id INTEGER PRIMARY KEY,  -- key
    split_id INTEGER NOT NULL REFERENCES splits (id) ON DELETE CASCADE,  -- its split
    name TEXT NOT NULL,  -- name of the live image
    reference_id INTEGER NOT NULL REFERENCES images (id),  -- past image
    live_id INTEGER NOT NULL REFERENCES images (id),  -- present image
    viewpoint_distance REAL CHECK (viewpoint_distance >= 0),  -- metres; NULL without poses
    UNIQUE (split_id, name)
) STRICT;
CREATE INDEX pairs_live ON pairs (live_id);
CREATE INDEX pairs_reference ON pairs (reference_id);

CREATE TABLE annotators (  -- people who sign in
    id INTEGER PRIMARY KEY,  -- key
    name TEXT NOT NULL UNIQUE CHECK (length(name) BETWEEN 1 AND 80),  -- shown name
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;

CREATE TABLE mask_revisions (  -- ground truth of a pair, append-only
    id INTEGER PRIMARY KEY,  -- key
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    number INTEGER NOT NULL CHECK (number >= 1),  -- 1, 2, 3 .. within the pair
    parent INTEGER NOT NULL CHECK (parent = number - 1),  -- number it was made from, 0 = none
    annotator_id INTEGER REFERENCES annotators (id),  -- who; NULL for an import
    source TEXT NOT NULL  -- how it came
        CHECK (source IN ('import', 'edit', 'confirmed_empty', 'api')),{MASK}
    ignore_rle TEXT,  -- pixels not to score, run-lengths of the same size; NULL = none
    active_seconds REAL NOT NULL DEFAULT 0 CHECK (active_seconds >= 0),  -- work, without idling
    tool_log TEXT NOT NULL DEFAULT '[]' CHECK (json_valid(tool_log)),  -- JSON list of actions
    created_at TEXT NOT NULL,  -- UTC, ISO 8601
    UNIQUE (pair_id, number)
) STRICT;

CREATE TRIGGER mask_revisions_stay BEFORE UPDATE ON mask_revisions
BEGIN SELECT RAISE (ABORT, 'mask revisions are append-only'); END;

CREATE TRIGGER mask_revisions_last BEFORE DELETE ON mask_revisions
BEGIN SELECT RAISE (ABORT, 'mask revisions are append-only'); END;

CREATE TABLE reviews (  -- state of a pair for an annotator
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- whose state
    state TEXT NOT NULL CHECK (state IN
        ('in_progress', 'submitted', 'approved', 'confirmed_empty')),  -- no row = todo
    revision INTEGER NOT NULL DEFAULT 0,  -- number of the mask revision it speaks of
    updated_at TEXT NOT NULL,  -- UTC, ISO 8601
    PRIMARY KEY (pair_id, annotator_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE runs (  -- one passage of the pipeline, or an imported layer set
    id INTEGER PRIMARY KEY,  -- key
    name TEXT NOT NULL UNIQUE CHECK (length(name) > 0),  -- shown name
    aligner TEXT NOT NULL,  -- registry name
    detector TEXT NOT NULL,  -- registry name, or "imported"
    segmenter TEXT NOT NULL,  -- registry name, or "imported"
    settings TEXT NOT NULL CHECK (json_valid(settings)),  -- every setting of every stage, JSON
    versions TEXT NOT NULL CHECK (json_valid(versions)),  -- code and library versions, JSON
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;

CREATE TABLE alignments (  -- reference -> live, of one run
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    flow BLOB NOT NULL,  -- zlib of int16 (h, w, 2): live pixel -> reference pixel, 1/32 pixel
    flow_stride INTEGER NOT NULL CHECK (flow_stride >= 1),  -- pixels between flow samples
    valid_rle TEXT NOT NULL,  -- run-lengths of the live pixels the warp reaches
    valid_fraction REAL NOT NULL CHECK (valid_fraction BETWEEN 0 AND 1),  -- share of them
    residual_before REAL NOT NULL,  -- mean absolute grey difference unaligned, 0..255
    residual_after REAL NOT NULL,  -- the same after the warp, inside the valid pixels
    seconds REAL NOT NULL,  -- time of the stage
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX alignments_pair ON alignments (pair_id);

CREATE TABLE detections (  -- M_o, the detector's change mask
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    probability BLOB,  -- grey PNG, 255 = certainly changed; NULL when only a mask was imported
    threshold REAL NOT NULL CHECK (threshold BETWEEN 0 AND 1),  -- changed where probability >{MASK}
    seconds REAL NOT NULL,  -- time of the stage
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX detections_pair ON detections (pair_id);

CREATE TABLE searches (  -- marks that the objects of a pair were searched, found or not
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    seconds REAL NOT NULL,  -- time of the stage
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE objects (  -- instances of O_l and O_r, both in the live frame
    id INTEGER PRIMARY KEY,  -- key
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    side TEXT NOT NULL CHECK (side IN ('live', 'reference')),  -- O_l or O_r
    number INTEGER NOT NULL CHECK (number >= 0),  -- 0, 1, 2 .. within run, pair and side
    label TEXT NOT NULL DEFAULT '',  -- open-vocabulary label, '' = none
    score REAL NOT NULL CHECK (score BETWEEN 0 AND 1),  -- the segmenter's confidence{MASK}
    UNIQUE (run_id, pair_id, side, number)
) STRICT;
CREATE INDEX objects_pair ON objects (pair_id);

CREATE TABLE regions (  -- one region under DoI
    id INTEGER PRIMARY KEY,  -- key
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    number INTEGER NOT NULL CHECK (number >= 0),  -- 0, 1, 2 .. within run and pair
    objects TEXT NOT NULL CHECK (json_valid(objects)),  -- JSON list: numbers of its live objects
    components TEXT NOT NULL CHECK (json_valid(components)),  -- JSON list: components of M_o
    overlap_px INTEGER NOT NULL CHECK (overlap_px >= 0),  -- pixels shared by O_l and O_r
    f_b INTEGER NOT NULL CHECK (f_b IN (0, 1)),  -- 1 = no overlap with the reference's objects
    iou REAL NOT NULL CHECK (iou BETWEEN 0 AND 1),  -- IoU(O_l, m)
    doi REAL NOT NULL CHECK (doi BETWEEN 0 AND 1),  -- f_b * (1 - iou)
    choice TEXT NOT NULL CHECK (choice IN ('adopt', 'keep')),  -- the decision
    inspect INTEGER NOT NULL CHECK (inspect IN (0, 1)),  -- 1 = the robot should look again
    reason TEXT NOT NULL,  -- reason code of reviewer.doi
    box_x INTEGER NOT NULL,  -- left column of the region's box
    box_y INTEGER NOT NULL,  -- top row of the region's box
    box_width INTEGER NOT NULL,  -- pixels
    box_height INTEGER NOT NULL,  -- pixels
    UNIQUE (run_id, pair_id, number)
) STRICT;
CREATE INDEX regions_pair ON regions (pair_id, run_id, doi);

CREATE TABLE predictions (  -- final masks of a run
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    method TEXT NOT NULL  -- base = M_o, doi = with DoI, audited = by people's verdicts
        CHECK (method IN ('base', 'doi', 'audited')),{MASK}
    PRIMARY KEY (run_id, pair_id, method)
) STRICT, WITHOUT ROWID;
CREATE INDEX predictions_pair ON predictions (pair_id);

CREATE TABLE failures (  -- pairs that a stage could not do
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    stage TEXT NOT NULL CHECK (stage IN ('align', 'detect', 'search', 'integrate')),  -- where
    message TEXT NOT NULL,  -- what went wrong
    created_at TEXT NOT NULL,  -- UTC, ISO 8601
    PRIMARY KEY (run_id, pair_id, stage)
) STRICT, WITHOUT ROWID;

CREATE TABLE scores (  -- pixel counts of a prediction against one mask revision
    run_id INTEGER NOT NULL,  -- its run
    pair_id INTEGER NOT NULL,  -- its pair
    method TEXT NOT NULL,  -- method of the prediction
    revision INTEGER NOT NULL,  -- number of the mask revision that was the truth
    tp INTEGER NOT NULL CHECK (tp >= 0),  -- changed, and found
    fp INTEGER NOT NULL CHECK (fp >= 0),  -- found, but not changed
    fn INTEGER NOT NULL CHECK (fn >= 0),  -- changed, but not found
    tn INTEGER NOT NULL CHECK (tn >= 0),  -- neither
    ignored INTEGER NOT NULL CHECK (ignored >= 0),  -- pixels left out
    PRIMARY KEY (run_id, pair_id, method),
    FOREIGN KEY (run_id, pair_id, method)
        REFERENCES predictions (run_id, pair_id, method) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE TABLE audits (  -- a person's verdict on a region's decision, append-only
    id INTEGER PRIMARY KEY,  -- key
    region_id INTEGER NOT NULL REFERENCES regions (id) ON DELETE CASCADE,  -- its region
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- who
    verdict TEXT NOT NULL CHECK (verdict IN ('agree', 'adopt', 'keep', 'reject')),  -- what
    comment TEXT NOT NULL DEFAULT '',  -- why, in the person's words
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;
CREATE INDEX audits_region ON audits (region_id, id);

CREATE TRIGGER audits_stay BEFORE UPDATE ON audits
BEGIN SELECT RAISE (ABORT, 'audits are append-only'); END;

CREATE TRIGGER audits_last BEFORE DELETE ON audits
BEGIN SELECT RAISE (ABORT, 'audits are append-only'); END;

CREATE VIEW ground_truth AS  -- the newest mask revision of every pair that has one
SELECT m.* FROM mask_revisions m
WHERE m.number = (SELECT max(n.number) FROM mask_revisions n WHERE n.pair_id = m.pair_id);

CREATE VIEW pair_scores AS  -- counts and scores per run, method and pair; stale counts are left out
SELECT r.name AS run, s.method, sp.name AS split, p.name AS pair, s.run_id, s.pair_id,
    s.tp, s.fp, s.fn, s.tn, s.ignored, s.revision,
    CASE WHEN s.tp + s.fp THEN 1.0 * s.tp / (s.tp + s.fp) ELSE 0.0 END AS precision,
    CASE WHEN s.tp + s.fn THEN 1.0 * s.tp / (s.tp + s.fn) ELSE 0.0 END AS recall,
    CASE WHEN 2 * s.tp + s.fp + s.fn
        THEN 2.0 * s.tp / (2 * s.tp + s.fp + s.fn) ELSE 0.0 END AS f_score
FROM scores s
JOIN runs r ON r.id = s.run_id
JOIN pairs p ON p.id = s.pair_id
JOIN splits sp ON sp.id = p.split_id
WHERE s.revision = (SELECT max(m.number) FROM mask_revisions m WHERE m.pair_id = s.pair_id);

CREATE VIEW split_scores AS  -- pooled pixels inside a split: the paper's protocol
SELECT run, method, split, count(*) AS pairs,
    sum(tp) AS tp, sum(fp) AS fp, sum(fn) AS fn, sum(tn) AS tn, sum(ignored) AS ignored,
    CASE WHEN sum(tp) + sum(fp) THEN 1.0 * sum(tp) / (sum(tp) + sum(fp)) ELSE 0.0 END AS precision,
    CASE WHEN sum(tp) + sum(fn) THEN 1.0 * sum(tp) / (sum(tp) + sum(fn)) ELSE 0.0 END AS recall,
    CASE WHEN 2 * sum(tp) + sum(fp) + sum(fn)
        THEN 2.0 * sum(tp) / (2 * sum(tp) + sum(fp) + sum(fn)) ELSE 0.0 END AS f_score
FROM pair_scores GROUP BY run, method, split;

CREATE VIEW doi_decisions AS  -- one row a region, with the newest verdict a person gave
SELECT g.id AS region_id, r.name AS run, sp.name AS split, p.name AS pair, g.number,
    g.overlap_px, g.f_b, g.iou, g.doi, g.choice, g.inspect, g.reason,
    (SELECT group_concat(DISTINCT o.label) FROM objects o, json_each(g.objects) j
        WHERE o.run_id = g.run_id AND o.pair_id = g.pair_id AND o.side = 'live'
        AND o.number = j.value) AS labels,
    a.verdict, n.name AS annotator, a.comment, a.created_at AS audited_at
FROM regions g
JOIN runs r ON r.id = g.run_id
JOIN pairs p ON p.id = g.pair_id
JOIN splits sp ON sp.id = p.split_id
LEFT JOIN audits a ON a.id = (SELECT max(b.id) FROM audits b WHERE b.region_id = g.id)
LEFT JOIN annotators n ON n.id = a.annotator_id;
