"""The version stands in two places; they say the same."""

import tomllib
from pathlib import Path

import reviewer
from reviewer.version import VERSION

ROOT = Path(__file__).resolve().parent.parent


def test_the_package_and_its_project_file_are_of_one_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == VERSION == reviewer.__version__
