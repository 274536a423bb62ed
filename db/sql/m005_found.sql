CREATE TABLE found_names (  -- names that people gave to what was found
    region_id INTEGER PRIMARY KEY REFERENCES regions (id) ON DELETE CASCADE,  -- its region
    name TEXT NOT NULL CHECK (length(name) > 0),  -- the object's name
    annotator_id INTEGER NOT NULL REFERENCES annotators (id),  -- who
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;

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
