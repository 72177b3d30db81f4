"""The site of docs/ is built without a warning; its search, its navigation and its links work from disk."""

from __future__ import annotations

import json
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

TERMS = ["Anchors", "Fold", "Pilot", "Rest curvature", "Spot check", "Stability margin"]


class Links(HTMLParser):
    """Targets of a page, and those of its navigation."""

    def __init__(self) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.navigation: list[str] = []
        self.loaded: list[str] = []
        self.lists = 0

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        values = dict(attributes)
        target = values.get("href") or values.get("src")
        if tag == "ul" and (self.lists or "navbar-nav" in (values.get("class") or "")):
            self.lists += 1
        if not target:
            return
        self.targets.append(target)
        if tag == "a" and self.lists:
            self.navigation.append(target)
        if tag != "a":
            self.loaded.append(target)

    def handle_endtag(self, tag: str) -> None:
        if tag == "ul" and self.lists:
            self.lists -= 1


def links(page: Path) -> Links:
    found = Links()
    found.feed(page.read_text("utf-8"))
    return found


@pytest.fixture(scope="module")
def site(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="mkdocs is not installed: pip install -r release/pages/requirements.txt")
    folder = tmp_path_factory.mktemp("site")
    words = ["build", "--strict", "--config-file", str(root / "release/pages/mkdocs.yml"), "--site-dir", str(folder)]
    done = subprocess.run([sys.executable, "-m", "mkdocs", *words], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return folder


def test_search_finds_terms_of_the_glossary(site: Path) -> None:
    text = (site / "search/search_index.json").read_text("utf-8")
    titles = {entry["title"]: entry["location"] for entry in json.loads(text)["docs"] if "glossary" in entry["location"]}
    for term in TERMS:
        assert titles.get(term) == f"docs/glossary.html#{term.lower().replace(' ', '-')}"
    # From disk a browser reads it as a script.
    assert (site / "search/search_index.js").read_text("utf-8") == f"window.searchIndex = {text};\n"


def test_every_page_is_in_the_navigation(site: Path, root: Path) -> None:
    navigation = links(site / "index.html").navigation
    pages = [page.stem for page in (root / "docs").glob("*.md")]
    assert len(pages) > 20
    for page in pages:
        assert f"docs/{'index' if page == 'README' else page}.html" in navigation


def test_every_link_leads_to_a_file(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 30
    for page in pages:
        found = links(page)
        for target in found.targets:
            parts = urlsplit(target)
            if parts.scheme or not parts.path:
                continue
            assert not target.startswith("/"), f"{page.name}: {target}"
            assert (page.parent / unquote(parts.path)).is_file(), f"{page.name}: {target}"
        # Nothing comes over a network.
        assert not [target for target in found.loaded if urlsplit(target).netloc], page.name
