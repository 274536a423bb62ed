CREATE TABLE looking_times (  -- active seconds on a pair that changed no mask
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- whose time
    seconds REAL NOT NULL CHECK (seconds >= 0),  -- work, without idling
    PRIMARY KEY (pair_id, annotator_id)
) STRICT, WITHOUT ROWID;

CREATE VIEW pair_effort AS  -- active seconds of an annotator on a pair: drawing and looking
SELECT sp.name AS split, p.name AS pair, n.name AS annotator, e.pair_id, e.annotator_id,
    sum(e.seconds) AS active_seconds
FROM (
    SELECT pair_id, annotator_id, active_seconds AS seconds FROM mask_revisions
    UNION ALL SELECT pair_id, annotator_id, seconds FROM looking_times
) e
JOIN pairs p ON p.id = e.pair_id
JOIN splits sp ON sp.id = p.split_id
JOIN annotators n ON n.id = e.annotator_id
GROUP BY e.pair_id, e.annotator_id;
