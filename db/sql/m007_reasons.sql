CREATE TABLE audit_reasons (  -- reasons that are offered with a verdict; people edit this list
    number INTEGER PRIMARY KEY CHECK (number >= 0),  -- place in the list
    reason TEXT NOT NULL UNIQUE CHECK (length(reason) BETWEEN 1 AND 80)  -- the words
) STRICT;
INSERT INTO audit_reasons VALUES
    (0, 'shadow or reflection'), (1, 'bad alignment'), (2, 'mask too large'),
    (3, 'mask too small'), (4, 'was there before'), (5, 'cannot tell');

DROP VIEW found;
DROP VIEW doi_decisions;
DROP TRIGGER audits_stay;
DROP TRIGGER audits_last;
DROP INDEX audits_region;
ALTER TABLE audits RENAME TO old_audits;
CREATE TABLE audits (  -- a person's verdict on a region's decision, append-only
    id INTEGER PRIMARY KEY,  -- key
    region_id INTEGER NOT NULL REFERENCES regions (id) ON DELETE CASCADE,  -- its region
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- who
    verdict TEXT NOT NULL CHECK (verdict IN ('agree', 'adopt', 'keep', 'reject')),  -- what
    reason TEXT NOT NULL DEFAULT '',  -- why, from the list as it was then; '' = none was given
    comment TEXT NOT NULL DEFAULT '',  -- more, in the person's words
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;
INSERT INTO audits SELECT id, region_id, annotator_id, verdict, '', comment, created_at
    FROM old_audits;
DROP TABLE old_audits;
CREATE INDEX audits_region ON audits (region_id, id);

CREATE TRIGGER audits_stay BEFORE UPDATE ON audits
BEGIN SELECT RAISE (ABORT, 'audits are append-only'); END;

CREATE TRIGGER audits_last BEFORE DELETE ON audits
BEGIN SELECT RAISE (ABORT, 'audits are append-only'); END;

CREATE VIEW doi_decisions AS  -- one row a region, with the newest verdict a person gave
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
LEFT JOIN audits a ON a.id = (SELECT max(b.id) FROM audits b WHERE b.region_id = g.id)
LEFT JOIN annotators n ON n.id = a.annotator_id;

CREATE VIEW opinions AS  -- what each person said last of a region, and what that makes of it
SELECT a.region_id, g.run_id, g.pair_id, n.name AS annotator, a.annotator_id, a.verdict,
    coalesce(nullif(a.verdict, 'agree'), g.choice) AS outcome, a.reason, a.comment, a.created_at
FROM audits a
JOIN regions g ON g.id = a.region_id
JOIN annotators n ON n.id = a.annotator_id
WHERE a.id = (SELECT max(b.id) FROM audits b
    WHERE b.region_id = a.region_id AND b.annotator_id = a.annotator_id);

CREATE VIEW found AS  -- what the final masks hold: one row a region, rejected ones left out
-- An object without a label of its own goes by what was said of its component, or of the whole
-- mask if that was one thing.
SELECT d.region_id, d.run, g.run_id, d.split, d.pair, g.pair_id,
    coalesce(nullif(d.labels, ''),
        (SELECT min(l.label) FROM labels l JOIN json_each(g.components) c ON c.value = l.component
            WHERE l.run_id = g.run_id AND l.pair_id = g.pair_id AND l.label <> ''),
        (SELECT min(l.label) FROM labels l WHERE l.run_id = g.run_id AND l.pair_id = g.pair_id
            AND l.component IS NULL AND l.label <> '' HAVING count(*) = 1)) AS labels,
    f.name AS given_name,
    coalesce(nullif(d.verdict, 'agree'), d.choice) AS outcome, d.doi, d.f_b, d.inspect, d.reason,
    d.verdict, d.annotator, i.stamp, i.x, i.y, i.theta,
    g.box_x, g.box_y, g.box_width, g.box_height
FROM doi_decisions d
JOIN regions g ON g.id = d.region_id
JOIN pairs p ON p.id = g.pair_id
JOIN images i ON i.id = p.live_id
LEFT JOIN found_names f ON f.region_id = d.region_id
WHERE coalesce(nullif(d.verdict, 'agree'), d.choice) <> 'reject' AND g.box_width > 0
    AND (json_array_length(g.components) > 0
        OR coalesce(nullif(d.verdict, 'agree'), d.choice) = 'adopt');
