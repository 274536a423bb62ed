"""Lost and found: names that are merged, the list, its pictures, the page."""

import csv
import io
from itertools import pairwise

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.editing.verdicts import give_verdict
from reviewer.errors import NotFound
from reviewer.found.listing import list_named_finds, named_alike
from reviewer.found.names import UNNAMED, merge_name
from reviewer.found.thumbnails import RIM, SIDE, draw_thumbnail
from reviewer.store.finds import find_of_region, finds_version, name_finds
from reviewer.store.results import edit_label
from reviewer.store.reviews import annotator_id


@pytest.mark.parametrize(
    ("label", "name"),
    [("Pen", "pen"), ("a pen", "pen"), ("pens", "pen"), ("The  red Pen.", "red pen"),
     ("batteries", "battery"), ("boxes", "box"), ("brushes", "brush"), ("IC cards", "ic card"),
     ("glasses", "glasses"), ("glass", "glass"), ("bus", "bus"), ("paper_clips", "paper clip"),
     ("", UNNAMED), (" . ", UNNAMED)],
)  # fmt: skip
def test_labels_of_one_thing_have_one_name(label, name):
    assert merge_name(label) == name
    assert merge_name(name) == name


@pytest.fixture
def labelled(db, run):
    """The run's objects under three spellings of one name; each pair with one object."""
    with_object = db.read().execute("SELECT id FROM objects WHERE side = 'live' ORDER BY pair_id")
    for (key,), label in zip(with_object.fetchall(), ("a Pen", "pens"), strict=True):
        db.write(lambda c, k=key, n=label: c.execute("UPDATE objects SET label = ? WHERE id = ?",
                                                     [n, k]))  # fmt: skip
    return run


def test_what_was_adopted_is_listed_under_merged_names(db, labelled):
    items = list_named_finds(db, labelled.id)
    assert [(item.name, item.title) for item in items] == [("pen", "cs1/0000"), ("pen", "cs1/0001")]
    first = items[0]
    assert first.place == "0.03, 0.00" and first.when == "100.0 s"
    assert (first.verdict, 0 < first.find.doi < 0.9) == ("adopt", True)


def test_every_word_of_a_search_must_occur(db, labelled):
    assert len(list_named_finds(db, labelled.id, "PEN 0001")) == 1
    assert list_named_finds(db, labelled.id, "pen wallet") == []


def test_a_given_name_counts_before_the_label_and_can_be_taken_back(db, labelled):
    region = list_named_finds(db, labelled.id)[0].find.region_id
    ada = annotator_id(db, "Ada")
    name_finds(db, [region], "fountain pen", ada)
    assert {item.name for item in list_named_finds(db, labelled.id)} == {"fountain pen", "pen"}
    name_finds(db, [region], "", ada)
    assert {item.name for item in list_named_finds(db, labelled.id)} == {"pen"}
    with pytest.raises(NotFound, match="does not exist any more"):
        name_finds(db, [region, 999], "pen", ada)


def test_a_new_name_is_for_all_of_that_name_but_for_one_that_has_none(db, run, labelled):
    items = list_named_finds(db, labelled.id)
    assert named_alike(items, items[0]) == [item.find.region_id for item in items]
    db.write(lambda c: c.execute("UPDATE objects SET label = ''"))
    nameless = list_named_finds(db, labelled.id)
    assert {item.name for item in nameless} == {UNNAMED}
    assert named_alike(nameless, nameless[1]) == [nameless[1].find.region_id]


def test_verdicts_decide_what_was_found(db, labelled):
    region = list_named_finds(db, labelled.id)[0].find.region_id
    ada = annotator_id(db, "Ada")
    give_verdict(db, region, ada, "reject")
    assert [item.title for item in list_named_finds(db, labelled.id)] == ["cs1/0001"]
    with pytest.raises(NotFound, match="is not among what was found"):
        find_of_region(db, region)
    give_verdict(db, region, ada, "keep")
    assert len(list_named_finds(db, labelled.id)) == 1
    kept = list_named_finds(db, labelled.id, kept=True)
    assert [item.verdict for item in kept if item.title == "cs1/0000"] == ["keep (a person)"]


def test_a_name_said_of_the_whole_mask_names_its_one_object(db, run):
    def say(*labels):
        def work(c):
            c.execute("DELETE FROM labels")
            for k, (component, label) in enumerate(labels):
                c.execute("INSERT INTO labels VALUES (?, 1, ?, ?, '', ?, '', NULL, NULL)",
                          [run.id, k, component, label])  # fmt: skip

        db.write(work)
        return list_named_finds(db, run.id)[0].name

    assert say((None, "pen")) == "pen"
    assert say((0, "cup"), (None, "pen")) == "cup"
    # Of two names for the whole mask nobody knows whose is whose.
    assert say((None, "pen"), (None, "cup")) == UNNAMED
    assert say() == UNNAMED


def test_a_thumbnail_shows_the_thing_with_its_rim(db, labelled):
    find = list_named_finds(db, labelled.id)[0].find
    picture = cv2.imdecode(np.frombuffer(draw_thumbnail(db, find), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (SIDE, SIDE, 3)
    middle = picture[SIDE // 2, SIDE // 2, ::-1].astype(int)
    assert middle[0] > 200 and middle[1:].max() < 60  # the red square of the scene
    near = np.abs(picture[..., ::-1].astype(int) - RIM).max(axis=2) < 70
    assert 100 < near.sum() < 2500


def call(*given):
    return CliRunner().invoke(app, list(given))


def test_the_command_writes_a_table_csv_and_a_page_of_its_own(db, labelled, tmp_path):
    place = ["--db", str(db.path)]
    assert "cs1/0001" in call("found", *place).output
    rows = list(
        csv.DictReader(io.StringIO(call("found", "0000", "--format", "csv", *place).output))
    )
    assert [(row["name"], row["pair"]) for row in rows] == [("pen", "cs1/0000")]
    page = tmp_path / "found.html"
    done = call("found", "--format", "html", "--output", str(page), *place)
    assert "2 things in" in done.output
    text = page.read_text()
    assert text.count("data:image/jpeg;base64,") == 2 and 'src="http' not in text
    assert "2 things, 1 name, found by run" in text and "DoI 0." in text


def test_names_are_text_in_the_page_not_markup(db, labelled, tmp_path):
    region = list_named_finds(db, labelled.id)[0].find.region_id
    name_finds(db, [region], "<script>alert(1)</script>", annotator_id(db, "Ada"))
    page = call("found", "--format", "html", "--db", str(db.path)).output
    assert "&lt;script&gt;alert" in page and "<script>alert" not in page


def test_a_database_without_a_run_says_so(db, tiny_split):
    result = call("found", "--db", str(db.path))
    assert isinstance(result.exception, NotFound) and "reviewer run" in str(result.exception)


def test_the_version_changes_with_all_that_the_list_shows(db, labelled):
    seen = [finds_version(db, labelled.id)]
    region = list_named_finds(db, labelled.id)[0].find.region_id
    ada = annotator_id(db, "Ada")
    for change in (
        lambda: name_finds(db, [region], "pen", ada),
        lambda: name_finds(db, [region], "", ada),
        lambda: give_verdict(db, region, ada, "keep"),
        lambda: edit_label(db, labelled.id, 1, 0, "wallet", ada),
    ):
        change()
        seen.append(finds_version(db, labelled.id))
    assert all(a != b for a, b in pairwise(seen))
    assert finds_version(db, labelled.id) == seen[-1]
