"""The doctor: what is good, what is only missing, what is broken."""

import pytest

from reviewer import doctor as checks
from reviewer.doctor import check_all, check_store


@pytest.fixture(autouse=True)
def own_caches(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))


def by_subject(found):
    return {check.subject: check for check in found}


def test_a_sound_database_is_good_and_missing_weights_are_notes(db, tiny_split):
    found = by_subject(check_all(db.path, deep=True))
    assert {c.finding for c in found.values()} == {"good", "note"}
    assert found["images"].found == "6, hashes as imported"
    assert found["model sam2-tiny"].found == "not here; reviewer models fetch sam2-tiny"
    assert "cpu" in found["device"].found or "cuda" in found["device"].found
    assert {"reviewer", "memory", "ray", "database", "disk", "browser"} <= set(found)


def test_images_that_are_gone_or_changed_are_bad(db, tiny_split):
    tiny_split[0].live.path.unlink()
    tiny_split[1].live.path.write_bytes(tiny_split[2].live.path.read_bytes())
    quick = by_subject(check_store(db.path, deep=False))["images"]
    assert quick.finding == "bad" and "0000.png is gone" in quick.found
    deep = by_subject(check_store(db.path, deep=True))["images"]
    assert "0001.png has changed since its import" in deep.found


def test_a_row_that_points_nowhere_and_a_file_that_is_no_database_are_bad(db, tiny_split, tmp_path):
    db.write(lambda c: c.execute("PRAGMA foreign_keys"))
    import sqlite3

    raw = sqlite3.connect(db.path)
    raw.execute("UPDATE pairs SET live_id = 999 WHERE id = 1")
    raw.commit()
    raw.close()
    found = by_subject(check_store(db.path, deep=False))["database"]
    assert found.finding == "bad" and "points to a row of images" in found.found
    text = tmp_path / "text.db"
    text.write_text("no database at all, but long enough to be looked at as a header" * 30)
    assert by_subject(check_store(text, deep=False))["database"].finding == "bad"


def test_a_full_disk_is_bad_and_no_database_is_a_note(tmp_path, monkeypatch):
    monkeypatch.setattr(checks, "LEAST_FREE", 2**80)
    found = by_subject(check_all(tmp_path / "none.db", deep=False))
    assert found["disk"].finding == "bad"
    assert found["database"].finding == "note" and "reviewer import" in found["database"].found


def test_a_damaged_page_is_bad_and_names_the_way_out(db):
    people = [(f"{k} " + "x" * 70,) for k in range(4000)]
    db.write(lambda c: c.executemany("INSERT INTO annotators VALUES (NULL, ?, 'now')", people))
    path = db.path
    db.close()
    size = path.stat().st_size
    for place in (0.5, 0.01):  # a page of people, then the pages of the schema
        with path.open("r+b") as file:
            file.seek(int(size * place) // 4096 * 4096)
            file.write(b"\xa5" * 4096 * 8)
        found = by_subject(check_store(path, deep=False))["database"]
        assert found.finding == "bad" and "restore it from a backup" in found.found
