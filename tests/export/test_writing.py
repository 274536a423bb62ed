"""What holds for every export: it resumes, keeps to itself, and never writes what is not so."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from filelock import FileLock

from reviewer.errors import Conflict, InvalidInput
from reviewer.export.selection import Selection, select_labelled
from reviewer.export.writing import Copy, Part, fitting_shard, pair_parts, write_export
from reviewer.export.yolo import export_yolo

ALL = Selection()


@pytest.fixture
def labelled(db, tiny_split):
    return select_labelled(db, ALL)[0]


def live_files(item):
    return {f"{item.pair.name}.png": Copy(item.pair.live)}


def broken_after(labelled, count):
    """Parts of which the last ones fail, one after the other."""

    def files(item):
        if item in labelled[count:]:
            raise InvalidInput("stopped here")
        return live_files(item)

    return pair_parts(labelled, files)


def test_two_exports_of_one_target_do_not_meet(labelled, tmp_path):
    with FileLock(tmp_path / ".set.lock"), pytest.raises(Conflict, match="another export is"):
        write_export(tmp_path / "set", "x", {}, pair_parts(labelled, live_files))
    assert write_export(tmp_path / "set", "x", {}, pair_parts(labelled, live_files)) == 3
    assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith(".set")) == []


def test_an_image_that_is_another_one_now_is_not_exported(labelled, tmp_path):
    with labelled[1].pair.live.path.open("ab") as file:
        file.write(b"x")
    with pytest.raises(InvalidInput, match=r"0001\.png: is not the image that was imported"):
        write_export(tmp_path / "set", "x", {}, pair_parts(labelled, live_files))


def test_two_pairs_with_one_file_name_are_refused(labelled, tmp_path):
    twin = replace(labelled[0], pair=replace(labelled[0].pair, split="a", name="b__0000"))
    other = replace(labelled[1], pair=replace(labelled[1].pair, split="a__b", name="0000"))
    same = replace(other, pair=replace(other.pair, reference=twin.pair.reference))
    with pytest.raises(InvalidInput, match=r"a__b__0000\.png is the one of pair"):
        export_yolo([twin, same], tmp_path / "set", ALL)


def test_a_name_that_leads_out_of_the_export_is_refused(labelled, tmp_path):
    parts = [Part("evil", labelled[:1], lambda: {"../../evil.png": b"x"}, {})]
    with pytest.raises(InvalidInput, match="would lie outside the export"):
        write_export(tmp_path / "set", "x", {}, parts)
    assert not (tmp_path.parent / "evil.png").exists()


def test_a_journal_that_was_cut_off_is_read_as_far_as_it_goes(labelled, tmp_path):
    with pytest.raises(InvalidInput, match="stopped here"):
        write_export(tmp_path / "set", "x", {}, broken_after(labelled, 2))
    journal = tmp_path / ".set.partial" / ".journal.jsonl"
    kept = (tmp_path / ".set.partial" / "0000.png").stat().st_mtime_ns
    journal.write_text(journal.read_text() + '{"part": "cs1/0001", "of"')
    for count in (2, 3):
        try:
            write_export(tmp_path / "set", "x", {}, broken_after(labelled, count))
        except InvalidInput:
            assert count == 2
    assert (tmp_path / "set" / "0000.png").stat().st_mtime_ns == kept


def test_a_part_made_with_something_else_is_made_again(labelled, tmp_path):
    calls = []

    def parts(value):
        def files(item):
            calls.append(item.pair.name)
            if value == "old" and item is labelled[2]:
                raise InvalidInput("stopped here")
            return {f"{item.pair.name}.txt": value.encode()}

        return pair_parts(labelled, files, lambda item: value)

    with pytest.raises(InvalidInput):
        write_export(tmp_path / "set", "x", {}, parts("old"))
    calls.clear()
    write_export(tmp_path / "set", "x", {}, parts("new"))
    assert sorted(calls) == ["0000", "0001", "0002"]
    assert (tmp_path / "set" / "0000.txt").read_text() == "new"


def test_the_manifest_names_what_is_about_all_pairs_too(labelled, tmp_path, monkeypatch):
    (tmp_path / "set").mkdir()
    monkeypatch.chdir(tmp_path / "set")
    write_export(
        Path("inner"), "x", {}, pair_parts(labelled, live_files), finish=lambda: {"a/b.txt": b"hi"}
    )
    manifest = json.loads((tmp_path / "set" / "inner" / "manifest.json").read_text())
    assert list(manifest["files"]) == ["a/b.txt"] and len(manifest["pairs"]) == 3
    assert (tmp_path / "set" / "inner" / "a" / "b.txt").read_bytes() == b"hi"


def test_a_shard_of_large_pictures_holds_few(labelled):
    assert fitting_shard(labelled, 256) == 256
    large = replace(labelled[0], mask=replace(labelled[0].mask, height=3000, width=4000))
    assert fitting_shard([*labelled, large], 256) == 6
    huge = replace(labelled[0], mask=replace(labelled[0].mask, height=20000, width=20000))
    assert fitting_shard([huge], 256) == 1
