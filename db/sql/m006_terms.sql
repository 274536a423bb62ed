CREATE TABLE pair_terms (  -- all that a pair's scores under any DoI rule are made of
    run_id INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,  -- its run
    pair_id INTEGER NOT NULL REFERENCES pairs (id) ON DELETE CASCADE,  -- its pair
    revision INTEGER NOT NULL,  -- number of the mask revision that was the truth
    key TEXT NOT NULL,  -- key of the integration they belong to, see results
    truth_px INTEGER NOT NULL CHECK (truth_px >= 0),  -- changed pixels that are scored
    terms TEXT NOT NULL CHECK (json_valid(terms)),  -- JSON, see reviewer.evaluation.terms
    PRIMARY KEY (run_id, pair_id)
) STRICT, WITHOUT ROWID;

CREATE TABLE region_outcomes (  -- what each outcome of a region would give, inside that region
    region_id INTEGER NOT NULL REFERENCES regions (id) ON DELETE CASCADE,  -- its region
    outcome TEXT NOT NULL CHECK (outcome IN ('adopt', 'keep', 'reject')),  -- what would be done
    revision INTEGER NOT NULL,  -- number of the mask revision that was the truth
    tp INTEGER NOT NULL CHECK (tp >= 0),  -- changed, and found
    fp INTEGER NOT NULL CHECK (fp >= 0),  -- found, but not changed
    fn INTEGER NOT NULL CHECK (fn >= 0),  -- changed, but not found
    PRIMARY KEY (region_id, outcome)
) STRICT, WITHOUT ROWID;
