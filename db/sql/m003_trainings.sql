CREATE TABLE trainings (  -- detectors trained here: what on, how far, which checkpoint
    name TEXT PRIMARY KEY,  -- name of its folder
    net TEXT NOT NULL,  -- registry name of the net
    checkpoint TEXT NOT NULL,  -- best weights so far, relative to the database's folder
    checkpoint_sha256 TEXT NOT NULL,  -- hash of that file
    settings TEXT NOT NULL,  -- JSON: training, synthesis and data, with hashes
    data_sha256 TEXT NOT NULL,  -- hash of reference images, object bank and synthesis settings
    seed INTEGER NOT NULL,  -- seed of weights and pairs
    iteration INTEGER NOT NULL,  -- iterations done
    f_score REAL NOT NULL,  -- of the checkpoint, on synthetic validation pairs
    updated_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT, WITHOUT ROWID;
