CREATE TABLE sessions (  -- browsers that are signed in; a row that is gone is signed out
    key TEXT PRIMARY KEY CHECK (length(key) = 64),  -- HMAC of the cookie's id under the token
    annotator_id INTEGER NOT NULL REFERENCES annotators (id) ON DELETE CASCADE,  -- who
    created_at TEXT NOT NULL  -- UTC, ISO 8601
) STRICT;
