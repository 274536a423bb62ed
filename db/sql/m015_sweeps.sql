CREATE TABLE sweeps (  -- tiles of a pair that a person has looked at from close by
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- who looked
    columns INTEGER NOT NULL CHECK (columns >= 1),  -- tiles across the picture
    rows INTEGER NOT NULL CHECK (rows >= 1),  -- tiles down the picture
    tile INTEGER NOT NULL CHECK (tile >= 0 AND tile < columns * rows),  -- row by row from the top left
    swept_at TEXT NOT NULL,  -- UTC, ISO 8601, the first time
    PRIMARY KEY (pair_id, annotator_id, columns, rows, tile)
) STRICT, WITHOUT ROWID;

CREATE VIEW pair_sweeps AS  -- how many tiles of a pair a person has swept, and of how many
SELECT sp.name AS split, p.name AS pair, n.name AS annotator, w.pair_id, w.annotator_id,
    count(*) AS swept, w.columns * w.rows AS tiles, max(w.swept_at) AS swept_at
FROM sweeps w
JOIN pairs p ON p.id = w.pair_id
JOIN splits sp ON sp.id = p.split_id
JOIN annotators n ON n.id = w.annotator_id
GROUP BY w.pair_id, w.annotator_id, w.columns, w.rows;

DROP VIEW pair_effort;
CREATE VIEW pair_effort AS  -- active seconds of an annotator on a pair, and the share that was swept
SELECT sp.name AS split, p.name AS pair, n.name AS annotator, e.pair_id, e.annotator_id,
    sum(e.seconds) AS active_seconds,
    coalesce((SELECT max(1.0 * s.swept / s.tiles) FROM pair_sweeps s
        WHERE s.pair_id = e.pair_id AND s.annotator_id = e.annotator_id), 0.0) AS swept
FROM (
    SELECT pair_id, annotator_id, active_seconds AS seconds FROM mask_revisions
    UNION ALL SELECT pair_id, annotator_id, seconds FROM looking_times
    UNION ALL SELECT DISTINCT pair_id, annotator_id, 0.0 FROM sweeps
) e
JOIN pairs p ON p.id = e.pair_id
JOIN splits sp ON sp.id = p.split_id
JOIN annotators n ON n.id = e.annotator_id
GROUP BY e.pair_id, e.annotator_id;
