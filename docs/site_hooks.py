"""MkDocs hooks: take the pages that lie outside docs/ into the site, and let links follow them.

Pages are written for a reader of the repository, where README.md, CONTRIBUTING.md and db/README.md
lie beside docs/. The site has them under names of its own (`OUTSIDE`).
"""

import posixpath
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
OUTSIDE = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "CITATION.cff": "citation.cff",
    "db/README.md": "database.md",
}
"""Where the site has what lies outside docs/, by the path in the repository."""
LOADS = re.compile(r"""<(?:script|link|img|iframe)\b[^>]*\b(?:src|href)=["']?https?://[^>]*>""")
LINK = re.compile(r"(\]\()([^)#\s:]+)")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages from outside docs/."""
    from mkdocs.structure.files import File

    for source, name in OUTSIDE.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text("utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links that are right in the repository into those of the site."""
    return site_links(markdown, page.file.src_uri)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Refuse a page that would load something from elsewhere."""
    from mkdocs.exceptions import PluginError

    if found := LOADS.search(output):
        raise PluginError(f"{page.file.src_uri}: loads from elsewhere: {found[0]}")
    return output


def site_links(markdown: str, name: str) -> str:
    """Return a page of the site, `name`, with its links as the site needs them."""
    source = {site: path for path, site in OUTSIDE.items()}.get(name, f"docs/{name}")

    def follow(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), match[2]))
        on_site = OUTSIDE.get(target) or target.removeprefix("docs/")
        return match[1] + posixpath.relpath(on_site, posixpath.dirname(name) or ".")

    return LINK.sub(follow, markdown)
