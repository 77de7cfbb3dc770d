"""Hook of MkDocs: the site has the tree of the project, so that the links between its pages hold there too.

MkDocs reads `docs/` only. This hook puts those pages below `docs/` and adds every file of the project that a page links to.
"""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

PROJECT = Path(__file__).resolve().parent.parent
# Room for formulas and wide tables; formulas close together, little larger than the text.
STYLE = """.md-grid { max-width: 76rem }
.md-typeset div.arithmatex, .md-typeset div.arithmatex > *, .md-typeset .katex-display { margin: 0.2em auto !important }
.md-typeset .katex { font-size: 1.1em }
"""
# Formulas are marked by pymdownx.arithmatex and set by KaTeX.
FORMULAS = """document.addEventListener("DOMContentLoaded", () => document.querySelectorAll(".arithmatex").forEach((formula) =>
  renderMathInElement(formula, { delimiters: [{ left: "\\\\(", right: "\\\\)" }, { left: "\\\\[", right: "\\\\]", display: true }] })));
"""
LINK = re.compile(r"\[([^\[\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")


# Before mkdocs-jupyter, which takes the notebooks among these files.
@event_priority(100)
def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """The pages of `docs/`, the README, and what they link to."""
    found = [file for file in files if file.abs_src_path is None or PROJECT / "docs" not in Path(file.abs_src_path).parents]
    open_, known = [PROJECT / "README.md", *sorted((PROJECT / "docs").rglob("*.md"))], set()
    while open_:
        path = open_.pop()
        if path in known:
            continue
        known.add(path)
        found.append(File(path.relative_to(PROJECT).as_posix(), str(PROJECT), config.site_dir, config.use_directory_urls))
        if path.suffix == ".md":
            open_ += [target for _, target in targets(path) if target.is_file()]
    found.append(File.generated(config, "site.css", content=STYLE))
    found.append(File.generated(config, "formulas.js", content=FORMULAS))
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
