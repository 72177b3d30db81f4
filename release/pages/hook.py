"""Lays the site out as the repository is, so that links from docs/ to files outside of it work there, too."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File, Files

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LINK = re.compile(r"\]\(([^)\s#]+)")


def linked(page: str) -> set[str]:
    """Files of the repository that a page links to, from its root."""
    targets = [link for link in LINK.findall((ROOT / page).read_text("utf-8")) if "://" not in link]
    paths = [(ROOT / page).parent.joinpath(target).resolve() for target in targets]
    return {path.relative_to(ROOT).as_posix() for path in paths if path.is_file() and path.is_relative_to(ROOT)}


def wanted(files: Files) -> list[str]:
    """The README, docs/, and what these link to, and so on."""
    found: set[str] = set()
    left = {"README.md"} | {f"docs/{file.src_uri}" for file in files.documentation_pages()}
    while left:
        found |= left
        pages = [name for name in left if PurePosixPath(name).suffix == ".md"]
        left = set().union(*map(linked, pages)) - found
    return sorted(found)


def on_config(config: MkDocsConfig) -> None:
    """No page for addresses that do not exist: only a server shows it."""
    config.theme.static_templates.discard("404.html")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    of_theme = [file for file in files if file.src_dir != config.docs_dir]
    pages = [File(name, str(ROOT), config.site_dir, config.use_directory_urls) for name in wanted(files)]
    script = File.generated(config, "search/offline.js", abs_src_path=str(HERE / "offline.js"))
    return Files([*of_theme, *pages, script])


@event_priority(-100)
def on_post_build(config: MkDocsConfig) -> None:
    """The index of the search as a script, too: a browser reads no JSON from disk."""
    folder = Path(config.site_dir) / "search"
    index = (folder / "search_index.json").read_text("utf-8")
    (folder / "search_index.js").write_text(f"window.searchIndex = {index};\n", "utf-8")
