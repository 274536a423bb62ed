"""The writer, the readers, the schema."""

import sqlite3
import threading

import pytest
import sqlite_utils

from reviewer.errors import InvalidInput, NotFound
from reviewer.shipped import shipped_folder
from reviewer.store.database import Store, load_migrations
from reviewer.store.describe import describe_schema


def add_person(name):
    return lambda db: db.execute(
        "INSERT INTO annotators (name, created_at) VALUES (?, 'now')", [name]
    )


def test_a_failing_write_leaves_nothing_and_the_writer_goes_on(db):
    def fails(connection):
        add_person("Ada")(connection)
        raise ValueError("halfway")

    with pytest.raises(ValueError, match="halfway"):
        db.write(fails)
    db.write(add_person("Bob"))
    names = [row["name"] for row in db.read().execute("SELECT name FROM annotators")]
    assert names == ["Bob"]


def test_readers_cannot_write(db):
    with pytest.raises(sqlite3.OperationalError, match="readonly"):
        add_person("Ada")(db.read())


def test_many_threads_write_one_after_another(db):
    threads = [threading.Thread(target=db.write, args=[add_person(f"p{k}")]) for k in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert db.read().execute("SELECT count(*) FROM annotators").fetchone()[0] == 20


def test_the_file_is_durable_and_checked(db):
    pragmas = db.write(
        lambda c: [c.execute(f"PRAGMA {p}").fetchone()[0] for p in ("synchronous", "foreign_keys")]
    )
    assert pragmas == [2, 1]
    assert db.read().execute("PRAGMA journal_mode").fetchone()[0] == "wal"


def test_readers_of_finished_threads_are_closed(db):
    for _ in range(20):
        thread = threading.Thread(target=db.read)
        thread.start()
        thread.join()
    assert len(db._readers) <= 2


def test_a_missing_database_says_how_to_make_one(tmp_path):
    with pytest.raises(NotFound, match="reviewer import"):
        Store(tmp_path / "none.db")


def test_a_file_that_is_no_database_is_refused(tmp_path):
    path = tmp_path / "x.db"
    path.write_text("this is a text, and long enough to be looked at as a database header" * 20)
    with pytest.raises(InvalidInput, match="not a database"):
        Store(path)


def test_a_database_of_a_newer_version_is_refused(tmp_path):
    with Store(tmp_path / "x.db", create=True) as store:
        store.write(
            lambda c: c.execute(
                "INSERT INTO _sqlite_migrations (migration_set, name, applied_at)"
                " VALUES ('reviewer', 'm999_future', 'now')"
            )
        )
    with pytest.raises(InvalidInput, match="m999_future"):
        Store(tmp_path / "x.db")


def test_a_database_from_before_keys_keeps_what_its_runs_made(tmp_path):
    migrations = load_migrations()
    old = sqlite_utils.Database(tmp_path / "x.db")
    for migration in migrations._migrations[:3]:
        migration.fn(old)
    zeros = ("0" * 64,) * 2
    mask = (2, 2, "04", 0, 0, 0, 0, 0)
    old.execute("INSERT INTO splits VALUES (1, 'cs1', 'cs', 1, 'sequence', NULL, 'now')")
    for key, session in ((1, "reference"), (2, "live")):
        old.execute(
            "INSERT INTO images VALUES (?, 1, ?, 'a', 'a.png', ?, 2, 2, 0, 0, 0, 0)",
            [key, session, zeros[0]],
        )
    old.execute("INSERT INTO pairs VALUES (1, 1, 'a', 1, 2, 0)")
    old.execute(
        "INSERT INTO runs VALUES (1, 'r', 'dis', 'difference', 'oversegment',"
        """ '{"high": 0.9}', '{}', 'now')"""
    )
    old.execute("INSERT INTO alignments VALUES (1, 1, x'00', 4, '04', 0.5, 9.0, 3.0, 0.1)")
    old.execute(
        "INSERT INTO detections VALUES (1, 1, NULL, 0.5, ?, ?, ?, ?, ?, ?, ?, ?, 0.2)", mask
    )
    old.execute("INSERT INTO searches VALUES (1, 1, 0.3)")
    old.execute("INSERT INTO failures VALUES (1, 1, 'search', 'what went wrong', 'now')")
    old.execute(
        "INSERT INTO regions VALUES (1, 1, 1, 0, '[]', '[]', 0, 1, 0, 1, 'keep', 1, 'x',"
        " 0, 0, 1, 1)"
    )
    old.execute("INSERT INTO annotators VALUES (1, 'Ada', 'now')")
    old.execute("INSERT INTO audits VALUES (1, 1, 1, 'reject', 'a shadow', 'then')")
    old.conn.commit()
    for migration in migrations._migrations[3:]:
        migration.fn(old)
    old.conn.commit()
    rows = old.query("SELECT stage, seconds, key FROM results ORDER BY seconds")
    assert [(row["stage"], row["seconds"]) for row in rows if row["key"].startswith("given:")] == [
        ("label", 0.0),
        ("align", 0.1),
        ("detect", 0.2),
        ("search", 0.3),
    ]
    (alignment,) = old.query("SELECT * FROM alignments")
    assert (alignment["residual_after"], alignment["backward_px"], alignment["doubt"]) == (
        3.0,
        None,
        "",
    )
    (run,) = old.query("SELECT json_extract(settings, '$.labeller') AS labeller FROM runs")
    assert run["labeller"] == "none"
    (run,) = old.query("SELECT json_extract(settings, '$.seen') AS seen FROM runs")
    assert run["seen"] == "keep"
    assert [row["message"] for row in old.query("SELECT message FROM failures")] == [
        "what went wrong"
    ]
    assert [row["threshold"] for row in old.query("SELECT * FROM detections")] == [0.5]
    (audit,) = old.query("SELECT * FROM doi_decisions")
    assert (audit["verdict"], audit["verdict_reason"], audit["comment"], audit["audited_at"]) == (
        "reject", "", "a shadow", "then",
    )  # fmt: skip
    with pytest.raises(sqlite3.IntegrityError, match="append-only"):
        old.execute("DELETE FROM audits")
    old.conn.close()


def test_a_region_may_be_rejected_and_nothing_else_is_new(db, run):
    before = db.read().execute("SELECT count(*) FROM regions").fetchone()[0]
    assert before and db.read().execute("PRAGMA integrity_check").fetchone()[0] == "ok"
    db.write(lambda c: c.execute("UPDATE regions SET choice = 'reject'"))
    with pytest.raises(sqlite3.IntegrityError, match="CHECK constraint failed"):
        db.write(lambda c: c.execute("UPDATE regions SET choice = 'drop'"))
    with pytest.raises(sqlite3.OperationalError, match="sqlite_master may not be modified"):
        db.write(lambda c: c.execute("UPDATE sqlite_master SET sql = '' WHERE name = 'regions'"))


def test_older_results_are_doubted_by_what_was_kept_of_them(tmp_path):
    known = load_migrations()._migrations
    place = next(k for k, migration in enumerate(known) if migration.name == "m011_skips")
    old = sqlite_utils.Database(tmp_path / "x.db")
    for migration in known[:place]:
        migration.fn(old)
    old.execute("PRAGMA foreign_keys = OFF")
    for pair, backward_px, doubt, area in (
        (1, 2.34, "reaches 9% of the view", 20),
        (2, None, "", 10),
        (3, 4.0, "forward-backward error 4.0 px", 0),
    ):
        old.execute(
            "INSERT INTO alignments VALUES (1, ?, x'00', 4, '04', 0.5, 9.0, 3.0, ?, ?)",
            [pair, backward_px, doubt],
        )
        old.execute(
            "INSERT INTO detections VALUES (1, ?, NULL, 0.5, 10, 10, '04', ?, 0, 0, 0, 0)",
            [pair, area],
        )
    known[place].fn(old)
    doubts = [[row["doubt"] for row in old.query(f"SELECT doubt FROM {table} ORDER BY pair_id")]
              for table in ("alignments", "detections")]  # fmt: skip
    assert doubts == [
        ["reaches 9% of the view; forward-backward error 2.3 px", "",
         "forward-backward error 4.0 px"],
        ["20% of the picture is called changed", "", ""],
    ]  # fmt: skip
    old.conn.close()


def test_counts_of_before_unseen_pixels_were_left_out_are_made_again(tmp_path):
    known = load_migrations()._migrations
    place = next(k for k, migration in enumerate(known) if migration.name == "m014_unseen")
    old = sqlite_utils.Database(tmp_path / "x.db")
    for migration in known[:place]:
        migration.fn(old)
    old.execute("PRAGMA foreign_keys = OFF")
    old.execute("INSERT INTO alignments VALUES (1, 1, x'00', 4, '04', 0.5, 9.0, 3.0, 0.7, 'no')")
    old.execute("INSERT INTO scores VALUES (1, 1, 'doi', 1, 5, 6, 7, 8, 9)")
    old.execute("INSERT INTO pair_terms VALUES (1, 1, 1, 'key', 5, '{}')")
    old.execute("INSERT INTO region_outcomes VALUES (1, 'keep', 1, 5, 6, 7)")
    known[place].fn(old)
    assert [old[name].count for name in ("scores", "pair_terms", "region_outcomes")] == [0, 0, 0]
    (alignment,) = old["alignments"].rows
    assert (alignment["doubt"], alignment["backward_px"], alignment["confidence"]) == (
        "no", 0.7, None,
    )  # fmt: skip
    old.conn.close()


def test_every_table_is_strict(db):
    rows = db.read().execute(
        "SELECT sql FROM sqlite_master WHERE type = 'table' AND name NOT LIKE '%sqlite%'"
    )
    assert all("STRICT" in row["sql"] for row in rows)


def test_the_schema_page_is_up_to_date():
    page = (shipped_folder("db") / "README.md").read_text()
    assert page == describe_schema() + "\n", "run `make docs`"
