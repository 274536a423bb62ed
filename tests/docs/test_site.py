"""The pages of the documentation: all in the site, and every path and link in them is there."""

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import reviewer

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("site_hooks", ROOT / "docs" / "site_hooks.py")
hooks = importlib.util.module_from_spec(spec)
spec.loader.exec_module(hooks)

IN_DOCS = sorted((ROOT / "docs").rglob("*.md"))
OUTSIDE = [ROOT / path for path in hooks.OUTSIDE if path.endswith(".md")]
PAGES = [*IN_DOCS, *OUTSIDE]
LIVING = [page for page in PAGES if "decisions" not in page.parts and page.name != "CHANGELOG.md"]
"""Decisions and changelog speak of their time; what the others name must be there now."""


def name(page):
    return page.relative_to(ROOT).as_posix()


def pages_of(nav):
    for entry in nav:
        for value in entry.values():
            yield from [value] if isinstance(value, str) else pages_of(value)


def anchors(page):
    """The anchors that GitHub and MkDocs give the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    plain = [re.sub(r"[^\w\s-]", "", heading.lower()).strip() for heading in headings]
    return {re.sub(r"[-\s]+", "-", heading) for heading in plain}


def test_the_navigation_lists_every_page_once():
    config = yaml.safe_load((ROOT / "mkdocs.yml").read_text())
    in_site = [page.relative_to(ROOT / "docs").as_posix() for page in IN_DOCS]
    outside = [hooks.OUTSIDE[name(page)] for page in OUTSIDE]
    assert sorted(pages_of(config["nav"])) == sorted([*in_site, *outside])


def test_the_site_takes_nothing_from_elsewhere_and_fails_on_broken_links():
    config = yaml.safe_load((ROOT / "mkdocs.yml").read_text())
    assert config["strict"] is True and config["theme"]["font"] is False
    (build,) = re.findall(r"mkdocs build.*", (ROOT / "Makefile").read_text())
    assert build == "mkdocs build --strict"  # with --quiet, no warning is counted
    assert set(config["validation"]["links"].values()) == {"warn"}
    assert not {"extra_javascript", "extra_css"} & set(config)
    assert hooks.LOADS.search('<script src="https://example.org/x.js"></script>')
    assert not hooks.LOADS.search('<a href="https://example.org">there</a><img src="x.png">')


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_of_a_page_leads_somewhere(page):
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text())
    for link in links:
        if re.match(r"https?://", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.is_file(), f"{name(page)}: {link}"
        if anchor:
            assert anchor in anchors(target), f"{name(page)}: {link}"


@pytest.mark.parametrize("page", LIVING, ids=name)
def test_every_file_of_the_program_that_a_page_names_is_there(page):
    named = re.findall(
        r"`((?:reviewer|static|tests|benchmarks|db|docs)/[\w./-]*[\w/])`", page.read_text()
    )
    places = [path for path in named if not re.search("NAME|mNNN", path)]
    missing = [path for path in places if not (ROOT / path).exists()]
    assert missing == []


def test_links_of_the_repository_become_links_of_the_site():
    said = "[a](docs/guide.md#1-x) [b](db/README.md) ![c](docs/images/x.png) [d](https://x.org/y)"
    assert hooks.site_links(said, "index.md") == (
        "[a](guide.md#1-x) [b](database.md) ![c](images/x.png) [d](https://x.org/y)"
    )
    assert hooks.site_links("[a](../../README.md)", "decisions/0001-x.md") == "[a](../index.md)"
    assert hooks.site_links("[a](../db/README.md) [b](#here)", "guide.md") == (
        "[a](database.md) [b](#here)"
    )


def test_the_version_is_the_same_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert project["version"] == reviewer.__version__ == citation["version"]


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_the_hooks_before_a_commit_call_the_tools_of_the_dev_group():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    tools = {re.split(r"[>=<]", each)[0] for each in project["dependency-groups"]["dev"]}
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())
    hooks_of = {each["id"]: each["entry"].split() for each in config["repos"][0]["hooks"]}
    for program, *_ in hooks_of.values():
        assert Path(program).name in tools | {"python"}
    assert hooks_of["generated-pages"][1:] == ["docs/generate.py", "--check"]


@pytest.mark.parametrize("form", ["bug", "wrong-mask", "feature"])
def test_an_issue_form_asks_for_what_is_needed(form):
    asked = yaml.safe_load((ROOT / ".github" / "ISSUE_TEMPLATE" / f"{form}.yml").read_text())
    assert asked["name"] and asked["description"]
    needed = [each for each in asked["body"] if each.get("validations", {}).get("required")]
    assert len(needed) >= 2
    assert all(each["attributes"]["label"] for each in asked["body"] if each["type"] != "markdown")
