"""Plug-ins from outside the program: in folders that the user names, and in installed packages that advertise them.

A folder holds a folder for each kind, named as `railsim list` names it (`DIR/estimators/NAME.py`,
`DIR/scenarios/NAME.yaml`); the places of the repository (`DIR/railsim/effects/NAME.py`) are taken as well. An installed
package advertises a module, or a package of modules or data files, by an entry point of the group "railsim.KIND".
"""

import hashlib
import importlib
import os
import pkgutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from railsim.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

VARIABLE = "RAILSIM_PLUGINS"
_APART = ("_", ".", "test", "conftest.")
"""Files and folders whose names begin so hold no plug-ins."""


def plugin_folders() -> list[Path]:
    """Folders that `RAILSIM_PLUGINS` names.

    Raises
    ------
    InputError : one of them is not there.
    """
    given = os.environ.get(VARIABLE, "").split(os.pathsep)
    folders = list(dict.fromkeys(Path(text).absolute() for text in given if text))
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"plug-ins: '{folder}' is not a folder; mend --plugins or {VARIABLE}")
    return folders


@contextmanager
def more_plugins(folders: Iterable[Path | str]) -> Iterator[None]:
    """Look into `folders` too, in this process and in those that it starts."""
    before = os.environ.get(VARIABLE)
    known = [text for text in (before or "").split(os.pathsep) if text]
    new = [str(Path(folder).absolute()) for folder in folders]
    if new:
        os.environ[VARIABLE] = os.pathsep.join(dict.fromkeys([*known, *new]))
    try:
        yield
    finally:
        if new and before is None:
            del os.environ[VARIABLE]
        elif before is not None:
            os.environ[VARIABLE] = before


def files_outside(kind: str, home: str, pattern: str) -> list[Path]:
    """Files of a kind in plug-in folders; `home` is where the repository has them.

    Raises
    ------
    InputError : a plug-in folder is not there.
    """
    places = [folder / place for folder in plugin_folders() for place in dict.fromkeys((kind, home))]
    return [path for place in places for path in sorted(place.glob(pattern)) if not _apart(path.relative_to(place))]


def modules_outside(kind: str) -> list[str]:
    """Full names of the modules that entry points name, and of those in packages that they name.

    Raises
    ------
    InputError : an entry point names nothing that can be found.
    """
    names = []
    for name, folder in _advertised(kind):
        if folder is None:
            names.append(name)
        else:
            inner = pkgutil.iter_modules([str(folder)])
            names += [f"{name}.{one.name}" for one in inner if not one.ispkg and not one.name.startswith(_APART)]
    return list(dict.fromkeys(names))


def data_outside(kind: str, pattern: str) -> list[Path]:
    """Data files in packages that entry points name; raises as `modules_outside`."""
    return [path for _, folder in _advertised(kind) if folder for path in sorted(folder.glob(pattern))]


def load(file: Path) -> ModuleType:
    """The module in a file outside all packages; it may import from its own folder (`from ._parts import x`).

    Raises
    ------
    InputError : no such file, or its name cannot be a module's.
    """
    file = file.absolute()
    if not file.is_file():
        raise InputError(f"no file '{file}'; check the path")
    if not file.stem.isidentifier():
        raise InputError(f"'{file}': a plug-in has the name of its file; rename it with letters, digits and '_' only")
    package = f"railsim_plugins_{hashlib.sha256(str(file.parent).encode()).hexdigest()[:12]}"
    if package not in sys.modules:
        sys.modules[package] = ModuleType(package, f"Plug-ins of '{file.parent}'.")
        sys.modules[package].__path__ = [str(file.parent)]
    name = f"{package}.{file.stem}"
    if name not in sys.modules:
        importlib.invalidate_caches()  # the file may be younger than what Python remembers of its folder
    return importlib.import_module(name)


def any_outside() -> bool:
    """Whether a plug-in folder is named, or an installed package has plug-ins; raises as `plugin_folders`."""
    return bool(plugin_folders() or _entries(tuple(sys.path)))


def _apart(inner: Path) -> bool:
    return any(part.startswith(_APART) for part in inner.parts)


def _advertised(kind: str) -> Iterator[tuple[str, Path | None]]:
    """Full names that entry points of a kind name, with the folder where that is a package."""
    for entry in _entries(tuple(sys.path)).get(f"railsim.{kind}", ()):
        try:
            spec = find_spec(entry.module)
        except ImportError as error:
            raise InputError(f"{_described(entry)} cannot be imported: {error}; mend or remove that package") from None
        if spec is None:
            raise InputError(f"{_described(entry)} names no module; mend or remove that package")
        folders = list(spec.submodule_search_locations or [])
        yield entry.module, Path(folders[0]) if folders else None


def _described(entry: "EntryPoint") -> str:
    owner = f" of '{entry.dist.name}'" if entry.dist else ""
    return f"entry point '{entry.name} = {entry.value}' in '{entry.group}'{owner}"


@cache
def _entries(path: tuple[str, ...]) -> dict[str, Sequence["EntryPoint"]]:
    """Entry points of all groups of ours; read once for each `path` along which Python looks for packages."""
    from importlib.metadata import entry_points  # costs more than all else here

    del path
    found = entry_points()
    return {group: list(found.select(group=group)) for group in found.groups if group.startswith("railsim.")}
