UPDATE runs SET settings = json_set(settings, '$.seen', 'keep');

-- A rule may reject a region now. SQLite changes a CHECK by way of the schema's own text; making the
-- table again would ask for every table that hangs on its rows, verdicts among them.
PRAGMA writable_schema = ON;
UPDATE sqlite_master SET sql = replace(sql,
    'CHECK (choice IN (''adopt'', ''keep''))', 'CHECK (choice IN (''adopt'', ''keep'', ''reject''))')
    WHERE type = 'table' AND name = 'regions';
PRAGMA writable_schema = RESET;
-- Any change of the schema tells other connections to read it again.
CREATE TABLE made_anew (x INTEGER) STRICT;
DROP TABLE made_anew;
