"""Files and folders appear whole or not at all."""

import pytest

from reviewer.atomic import whole_file, whole_folder
from reviewer.errors import Conflict


def test_a_file_takes_the_place_of_the_old_one(tmp_path):
    path = tmp_path / "deep" / "a.bin"
    for content in (b"one", b"two"):
        with whole_file(path) as file:
            file.write(content)
    assert path.read_bytes() == b"two" and path.stat().st_mode & 0o777 == 0o644
    assert [p.name for p in path.parent.iterdir()] == ["a.bin"]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt), whole_file(path) as file:
        file.write(b"half")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_folder_that_fails_leaves_nothing(tmp_path):
    with pytest.raises(ValueError), whole_folder(tmp_path / "out") as folder:
        (folder / "a").touch()
        raise ValueError
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine").touch()
    with pytest.raises(Conflict, match="exists already"), whole_folder(tmp_path / "out"):
        pass
