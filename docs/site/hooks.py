"""MkDocs hooks: pages that are generated, pages from the top of the repository, tutorials as they were executed."""

import logging
import re
from pathlib import Path
from typing import Any

import gallery
import reference
import tutorials
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[2]
ABOVE = {"README.md": "overview.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
"""Files beside `docs`, and the page of the site that each becomes."""
LINK = re.compile(r"(\]\()([^)\s:#]+)((?:#[^)\s]*)?\))")
LOG = logging.getLogger("mkdocs.hooks.railsim")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that no file of `docs` holds, and the pictures of the gallery."""
    for name, page in ABOVE.items():
        text = LINK.sub(lambda found: found[1] + found[2].removeprefix("docs/") + found[3], (ROOT / name).read_text())
        text = LINK.sub(lambda found: found[1] + ABOVE.get(found[2], found[2]) + found[3], text)
        files.append(File.generated(config, page, content=text))
    for page, text in (reference.pages() | {"gallery.md": gallery.page()}).items():
        files.append(File.generated(config, page, content=text))
    for name, path in gallery.pictures().items():
        files.append(File.generated(config, f"gallery/{name}", abs_src_path=str(path)))
    files.append(File.generated(config, "CITATION.cff", abs_src_path=str(ROOT / "CITATION.cff")))
    for path in tutorials.products():
        files.append(File.generated(config, f"tutorials/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **others: Any) -> str:
    """Links to files beside `docs` lead to their pages; a tutorial shows what it printed and drew; pictures open."""
    path = page.file.src_uri
    if path.startswith("tutorials/") and not path.endswith("index.md"):
        executed = tutorials.executed(Path(path).stem)
        if executed is None:
            LOG.warning("%s has not been executed as it stands: run 'make docs'", path)
        markdown = executed or markdown
    return gallery.opening(LINK.sub(_to_page, markdown))


def _to_page(found: re.Match[str]) -> str:
    above, _, name = found[2].rpartition("/")
    is_above = name in ABOVE and above and set(above) <= {".", "/"}
    return found[1] + (f"{above.removesuffix('..')}{ABOVE[name]}" if is_above else found[2]) + found[3]
