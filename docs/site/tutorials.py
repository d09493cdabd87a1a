"""Tutorials: Markdown pages whose `bash` and `python` blocks are cells of a notebook, executed from top to bottom.

`python docs/site/tutorials.py NAME ...` executes and writes results/tutorials: NAME.ipynb, NAME.md and pictures.
"""

import base64
import hashlib
import os
import re
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "docs" / "tutorials"
RESULTS = ROOT / "results" / "tutorials"
BLOCK = re.compile(r"^```(bash|python)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
LONGEST = 40  # lines of an output that are shown
SLOWEST = 600  # s, of one cell
ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def executed(name: str) -> str | None:
    """Markdown of a tutorial with its outputs; None where the page has changed since it was executed."""
    path = RESULTS / f"{name}.md"
    text = path.read_text() if path.exists() else ""
    return text if text.endswith(stamp((SOURCES / f"{name}.md").read_text())) else None


def products() -> list[Path]:
    """Notebooks and pictures that the executed pages link to."""
    return sorted(path for path in RESULTS.glob("*") if path.suffix in (".ipynb", ".png"))


def parts_of(text: str) -> list[tuple[str, str]]:
    """(kind, text) in the order of the page; the kind is "markdown", "bash" or "python"."""
    parts, at = [], 0
    for found in BLOCK.finditer(text):
        parts += [("markdown", text[at : found.start()]), (found[1], found[2])]
        at = found.end()
    return [(kind, part) for kind, part in [*parts, ("markdown", text[at:])] if part.strip()]


def execute(name: str) -> None:
    """Run a tutorial in an empty folder; write it with its outputs.

    Raises
    ------
    nbclient.exceptions.CellExecutionError : a cell fails; a bash cell fails where one of its commands does.
    """
    import nbformat
    from jupyter_client.manager import AsyncKernelManager
    from nbclient import NotebookClient

    text = (SOURCES / f"{name}.md").read_text()
    notebook = nbformat.v4.new_notebook(metadata={"kernelspec": {"name": "python3", "display_name": "Python 3"}})
    notebook.cells = [_cell(kind, part) for kind, part in parts_of(text)]
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as sockets:
        kernel = AsyncKernelManager(transport="ipc", ip=f"{sockets}/kernel")  # no port that others could reach
        NotebookClient(notebook, km=kernel, timeout=SLOWEST, resources={"metadata": {"path": folder}}).execute()
    RESULTS.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, RESULTS / f"{name}.ipynb")
    took = f"It took {time.monotonic() - begun:.0f} s here. [The same as a notebook]({name}.ipynb)."
    shown = [_shown(cell, f"{name}_{at}.png") for at, cell in enumerate(notebook.cells)]
    (RESULTS / f"{name}.md").write_text("\n".join([*shown, took, stamp(text)]))


def stamp(text: str) -> str:
    """Last line of an executed page: which text it was made of."""
    return f"\n<!-- {hashlib.sha256(text.encode()).hexdigest()} -->\n"


def _cell(kind: str, text: str) -> Any:
    import nbformat

    if kind == "markdown":
        return nbformat.v4.new_markdown_cell(text)
    return nbformat.v4.new_code_cell(f"%%bash -e\n{text}" if kind == "bash" else text)


def _shown(cell: Any, picture: str) -> str:
    """Markdown of a cell, with what it printed and drew."""
    if cell.cell_type == "markdown":
        return cell.source
    is_bash = cell.source.startswith("%%bash")
    source = cell.source.partition("\n")[2] if is_bash else cell.source
    parts = [f"```{'bash' if is_bash else 'python'}\n{source.rstrip()}\n```\n"]
    printed = "".join(out.text for out in cell.outputs if out.output_type == "stream" and out.name == "stdout")
    for data in (out.data for out in cell.outputs if "data" in out):
        if "image/png" in data:
            (RESULTS / picture).write_bytes(base64.b64decode(data["image/png"]))
            parts.append(f"![What the lines above draw]({picture})\n")
        else:
            printed += data.get("text/plain", "") + "\n"
    if printed.strip():
        parts.insert(1, f"```text\n{_shortened(printed)}\n```\n")
    return "\n".join(parts)


def _shortened(text: str) -> str:
    lines = ESCAPES.sub("", text).strip("\n").splitlines()
    return "\n".join(
        lines if len(lines) <= LONGEST else [*lines[: LONGEST - 1], f"... {len(lines) - LONGEST + 1} lines more"]
    )


if __name__ == "__main__":
    for tutorial in sys.argv[1:]:
        execute(tutorial)
