DROP VIEW split_scores;
DROP VIEW pair_scores;
DROP VIEW ground_truth;

CREATE VIEW newest_revisions AS  -- the newest mask revision of every pair, finished or not
SELECT m.* FROM mask_revisions m
WHERE m.number = (SELECT max(n.number) FROM mask_revisions n WHERE n.pair_id = m.pair_id);

CREATE VIEW ground_truth AS  -- the revision of a pair that counts, and by what it stands
-- The newest approved one; else the newest that is submitted or confirmed empty; else the newest
-- imported one. What nobody has finished counts for nothing.
SELECT m.*, coalesce((SELECT r.state FROM reviews r WHERE r.pair_id = m.pair_id
        AND r.revision = m.number AND r.state <> 'in_progress'
        ORDER BY r.state = 'approved' DESC, r.state = 'confirmed_empty' DESC LIMIT 1),
    'imported') AS standing
FROM pairs p JOIN mask_revisions m ON m.pair_id = p.id AND m.number = coalesce(
    (SELECT max(r.revision) FROM reviews r WHERE r.pair_id = p.id AND r.state = 'approved'),
    (SELECT max(r.revision) FROM reviews r WHERE r.pair_id = p.id
        AND r.state IN ('submitted', 'confirmed_empty')),
    (SELECT max(i.number) FROM mask_revisions i WHERE i.pair_id = p.id AND i.source = 'import'));

CREATE VIEW pair_scores AS  -- counts and scores per run, method and pair; stale counts are left out
SELECT r.name AS run, s.method, sp.name AS split, p.name AS pair, s.run_id, s.pair_id,
    s.tp, s.fp, s.fn, s.tn, s.ignored, s.revision, t.standing,
    CASE WHEN s.tp + s.fp THEN 1.0 * s.tp / (s.tp + s.fp) ELSE 0.0 END AS precision,
    CASE WHEN s.tp + s.fn THEN 1.0 * s.tp / (s.tp + s.fn) ELSE 0.0 END AS recall,
    CASE WHEN 2 * s.tp + s.fp + s.fn
        THEN 2.0 * s.tp / (2 * s.tp + s.fp + s.fn) ELSE 0.0 END AS f_score
FROM scores s
JOIN runs r ON r.id = s.run_id
JOIN pairs p ON p.id = s.pair_id
JOIN splits sp ON sp.id = p.split_id
JOIN ground_truth t ON t.pair_id = s.pair_id AND t.number = s.revision;

CREATE VIEW split_scores AS  -- pooled pixels inside a split: the paper's protocol
SELECT run, method, split, count(*) AS pairs,
    sum(tp) AS tp, sum(fp) AS fp, sum(fn) AS fn, sum(tn) AS tn, sum(ignored) AS ignored,
    CASE WHEN sum(tp) + sum(fp) THEN 1.0 * sum(tp) / (sum(tp) + sum(fp)) ELSE 0.0 END AS precision,
    CASE WHEN sum(tp) + sum(fn) THEN 1.0 * sum(tp) / (sum(tp) + sum(fn)) ELSE 0.0 END AS recall,
    CASE WHEN 2 * sum(tp) + sum(fp) + sum(fn)
        THEN 2.0 * sum(tp) / (2 * sum(tp) + sum(fp) + sum(fn)) ELSE 0.0 END AS f_score
FROM pair_scores GROUP BY run, method, split;

CREATE VIEW team_states AS  -- where a pair stands for the team, whoever did it; no row = to do
SELECT r.pair_id, CASE
    WHEN max(r.state = 'approved') = 0 AND max(r.state <> 'in_progress') = 0 THEN 'in_progress'
    WHEN max(r.state = 'approved') = 0 THEN 'waiting'
    WHEN max(CASE WHEN r.state = 'approved' THEN r.revision END)
        < (SELECT max(m.number) FROM mask_revisions m WHERE m.pair_id = r.pair_id) THEN 'changed'
    ELSE 'approved' END AS state
FROM reviews r GROUP BY r.pair_id;
