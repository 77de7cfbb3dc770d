"""Hook of MkDocs: the site has the tree of the project, so that the links between its pages hold there too.

MkDocs reads `docs/` only. This hook puts those pages below `docs/` and adds every file of the project that a page links to.
"""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

PROJECT = Path(__file__).resolve().parent.parent
# Room for formulas and wide tables.
STYLE = ".md-grid { max-width: 76rem }"
LINK = re.compile(r"\[([^\[\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """The pages of `docs/`, the README, and what they link to."""
    found = [file for file in files if file.abs_src_path is None or PROJECT / "docs" not in Path(file.abs_src_path).parents]
    open_, known = [PROJECT / "README.md", *sorted((PROJECT / "docs").rglob("*.md"))], set()
    while open_:
        path = open_.pop()
        if path in known:
            continue
        known.add(path)
        found.append(File.generated(config, path.relative_to(PROJECT).as_posix(), abs_src_path=str(path)))
        if path.suffix == ".md":
            open_ += [target for _, target in targets(path) if target.is_file()]
    found.append(File.generated(config, "site.css", content=STYLE))
    return Files(found)


def on_page_markdown(markdown: str, *, page: Page, **_: object) -> str:
    """A link to a folder becomes the folder's name: a site shows no folders."""
    source = PROJECT / page.file.src_uri

    def shown(link: re.Match[str]) -> str:
        return link[1] if (source.parent / link[2]).is_dir() else link[0]

    return LINK.sub(shown, markdown)


def targets(page: Path) -> list[tuple[str, Path]]:
    """Words and files of a page's links within the project."""
    links = [(link[1], (page.parent / link[2]).resolve()) for link in LINK.finditer(page.read_text(encoding="utf-8")) if ":" not in link[2]]
    return [(words, target) for words, target in links if PROJECT in target.parents]
