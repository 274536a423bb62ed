DROP VIEW split_scores;
DROP VIEW pair_scores;

CREATE VIEW pair_scores AS  -- counts and scores per run, method and pair; no stale counts, no skipped pairs
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
JOIN ground_truth t ON t.pair_id = s.pair_id AND t.number = s.revision
WHERE s.pair_id NOT IN (SELECT pair_id FROM skips);

CREATE VIEW split_scores AS  -- pooled pixels inside a split: the paper's protocol
SELECT run, method, split, count(*) AS pairs,
    sum(tp) AS tp, sum(fp) AS fp, sum(fn) AS fn, sum(tn) AS tn, sum(ignored) AS ignored,
    CASE WHEN sum(tp) + sum(fp) THEN 1.0 * sum(tp) / (sum(tp) + sum(fp)) ELSE 0.0 END AS precision,
    CASE WHEN sum(tp) + sum(fn) THEN 1.0 * sum(tp) / (sum(tp) + sum(fn)) ELSE 0.0 END AS recall,
    CASE WHEN 2 * sum(tp) + sum(fp) + sum(fn)
        THEN 2.0 * sum(tp) / (2 * sum(tp) + sum(fp) + sum(fn)) ELSE 0.0 END AS f_score
FROM pair_scores GROUP BY run, method, split;
