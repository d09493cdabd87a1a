"""Which files a file of Python imports, read from its text: nothing is imported for it."""

import re
from pathlib import Path

from railsim.distribution import CODE, ROOT, is_ours

_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+([.\w]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+([^\n]+))", re.MULTILINE
)
_WORD = re.compile(r"[.\w]+")


def imported_files(file: Path) -> set[Path]:
    """Files that `file` imports from its own folder or package, and from the packages of this program."""
    files: set[Path | None] = set()
    for module, names, modules in _IMPORT.findall(file.read_bytes()):
        start = module.decode()
        dot = "" if start.endswith(".") else "."
        inner = [f"{start}{dot}{name}" for name in _WORD.findall(names.decode())] if start else []
        files |= {_file_of(one, file) for one in (start, *inner, *_WORD.findall(modules.decode())) if one}
    return {path for path in files if path and path != file}


def followed(file: Path) -> set[Path]:
    """`file` and all that it imports, directly or not, apart from this program's packages."""
    files, ahead = {file}, [file]
    while ahead:
        new = {path for path in imported_files(ahead.pop()) - files if not is_ours(path)}
        files |= new
        ahead += new
    return files


def _file_of(module: str, importer: Path) -> Path | None:
    """File of a module by its name in an import; None where it is somebody else's."""
    name = module.lstrip(".")
    parts = [part for part in name.split(".") if part]
    if level := len(module) - len(name):
        root = importer.parents[level - 1]
    elif parts[0] in CODE:
        root = ROOT
    else:
        root = _root_of(importer, parts[0])
    if root is None:
        return None
    place = root.joinpath(*parts)
    candidates = (place.with_suffix(".py"), place / "__init__.py") if parts else (place / "__init__.py",)
    return next((path for path in candidates if path.is_file()), None)


def _root_of(importer: Path, package: str) -> Path | None:
    """Folder that holds the top-level package in which the importer stands, if that is its name."""
    tops = [folder for folder in importer.parents if (folder / "__init__.py").is_file()]
    return tops[-1].parent if tops and tops[-1].name == package else None
