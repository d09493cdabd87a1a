"""Plug-ins are found, not listed: one file is one plug-in, and its file's name is its name.

They are looked for where the program keeps its own, and outside of it (`railsim.plugins`).
"""

import hashlib
import inspect
import os
import pkgutil
import traceback
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Generic, TypeVar

from railsim.distribution import CODE, ROOT, is_ours
from railsim.errors import InputError, nearest
from railsim.imports import followed
from railsim.plugins import data_outside, files_outside, load, modules_outside

T = TypeVar("T")
Origin = str | Path
"""Full name of a module, or the file of one outside all packages."""


@dataclass(frozen=True)
class Kind(Generic[T]):
    """A kind of plug-in that is code: classes that derive from one base.

    Attributes
    ----------
    name : plural; the folder in a plug-in folder and, after "railsim.", the group of entry points.
    package : home of those that ship. base : what all of them derive from.
    """

    name: str
    package: str
    base: type[T]

    @property
    def word(self) -> str:
        """Singular, for messages."""
        return self.base.__name__.lower()

    def classes(self) -> dict[str, type[T]]:
        """The one subclass of `base` that each module defines, by the module's own name, in the order of the names.

        Modules that define none (the interface itself, for example) are passed over.

        Raises
        ------
        InputError : a plug-in from outside cannot be imported or lacks a method, a module defines two, or two have the
            same name.
        """
        return self._classes(self._origins())

    def pick(self, name: str) -> type[T]:
        """The class of that name.

        Raises
        ------
        InputError : there is none; the line lists those that there are. Or as `classes`.
        """
        return self.find(name) or pick(self.classes(), name, self.word)

    def find(self, name: str) -> type[T] | None:
        """The class of that name, where there is one; no other plug-in is imported for it."""
        return self._classes(place for place in self._origins() if _name(place) == name).get(name)

    def resolve(self, name: str) -> type[T]:
        """As `pick`, of a name that a user gives, which may also be the path of a file: its code is run."""
        return self.in_file(Path(name)) if name.endswith(".py") else self.pick(name)

    def in_file(self, file: Path) -> type[T]:
        """The class that a file defines; raises `InputError` where that is not one."""
        own = self._defined(_module(_origin(file)))
        if len(own) != 1:
            base = f"{self.base.__module__}.{self.base.__name__}"
            raise InputError(f"'{file}' defines {len(own)} subclasses of {base}; one file holds one")
        return own[0]

    def has(self, file: Path) -> bool:
        """Whether a file defines a class of this kind, complete or not."""
        return bool(self._subclasses(_module(_origin(file))))

    def _origins(self) -> Iterator[Origin]:
        yield from _modules(self.package)
        yield from modules_outside(self.name)
        yield from files_outside(self.name, self.package.replace(".", "/"), "**/*.py")

    def _classes(self, origins: Iterable[Origin]) -> dict[str, type[T]]:
        classes: dict[str, type[T]] = {}
        origin_of: dict[str, Origin] = {}
        for source in sorted(origins, key=_name):
            name, own = _name(source), self._defined(_module(source))
            if len(own) > 1:
                raise InputError(f"'{source}' defines {len(own)} plug-ins; one file holds one")
            if own and name in classes:
                both = f"'{origin_of[name]}' and in '{source}'"
                raise InputError(f"{self.word} '{name}' stands in {both}; rename one of them")
            if own:
                classes[name], origin_of[name] = own[0], source
        return classes

    def _defined(self, module: ModuleType) -> list[type[T]]:
        """Subclasses of the base that the module defines, without those of ours that are not complete."""
        own = self._subclasses(module)
        for candidate in own:
            if inspect.isabstract(candidate) and not _is_ours(module.__name__):
                lacking = ", ".join(sorted(getattr(candidate, "__abstractmethods__", ())))
                place = f"{candidate.__name__} in '{module.__file__}'"
                raise InputError(f"{place} lacks {lacking}; add that, or begin the name of a mere base with '_'")
        return [one for one in own if not inspect.isabstract(one)]

    def _subclasses(self, module: ModuleType) -> list[type[T]]:
        """Public subclasses of the base that the module itself defines."""
        classes = [value for value in vars(module).values() if inspect.isclass(value)]
        own = [one for one in classes if one.__module__ == module.__name__ and not one.__name__.startswith("_")]
        return [one for one in own if issubclass(one, self.base) and one is not self.base]


@dataclass(frozen=True)
class Files:
    """A kind of plug-in that is data: one file is one.

    Attributes
    ----------
    name : as of `Kind`. home : folder of those that ship, from the top. suffix : of the files. word : singular.
    """

    name: str
    home: str
    suffix: str
    word: str

    def shipped(self) -> dict[str, Path]:
        """Files that come with the program, by name."""
        return {path.stem: path for path in sorted((ROOT / self.home).glob(f"*{self.suffix}"))}

    def paths(self) -> dict[str, Path]:
        """All files by name, in the order of the names.

        Raises
        ------
        InputError : two have the same name.
        """
        paths, pattern = self.shipped(), f"*{self.suffix}"
        for path in (*data_outside(self.name, pattern), *files_outside(self.name, self.home, pattern)):
            if path.stem in paths:
                both = f"'{paths[path.stem]}' and in '{path}'"
                raise InputError(f"{self.word} '{path.stem}' stands in {both}; rename one of them")
            paths[path.stem] = path
        return dict(sorted(paths.items()))

    def read(self, source: str | os.PathLike[str]) -> tuple[Path, str]:
        """Path and text of a file, by its name or its path.

        Raises
        ------
        InputError : no such file, or one that cannot be read as text.
        """
        path = Path(source)
        bare = path.name == str(source) and not path.suffix
        known = self.paths() if bare else {}
        path = known.get(str(source), path)
        try:
            return path, path.read_bytes().decode("utf-8-sig")
        except FileNotFoundError:
            hint = f"{nearest(str(source), known)}there are: {', '.join(known)}" if bare else "check the path"
            raise InputError(f"no {self.word} '{source}'; {hint}") from None
        except OSError as error:
            text = f"cannot read {self.word} '{source}': {error.strerror}; give a {self.suffix} file"
            raise InputError(text) from None
        except UnicodeDecodeError as error:
            text = f"{self.word} '{source}': byte {error.start} is not UTF-8 text; save the file as UTF-8"
            raise InputError(text) from None


def pick(known_entries: Mapping[str, T], name: str, what: str) -> T:
    """Entry `name`; raise `InputError` that lists what there is otherwise."""
    if name not in known_entries:
        known = ", ".join(sorted(known_entries)) or "none"
        raise InputError(f"unknown {what} '{name}'; {nearest(name, known_entries)}there are: {known}")
    return known_entries[name]


def source_digest(classes: Iterable[type]) -> str:
    """SHA-256 over the source of those classes that come from outside the program; empty where none does."""
    outside = {one for one in classes if not _is_ours(one.__module__)}
    files = {path for one in outside for path in followed(Path(inspect.getfile(one)))}
    total = hashlib.sha256()
    for path in sorted(files, key=lambda path: (path.name, path)):
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest() if files else ""


@cache
def _modules(package: str) -> tuple[str, ...]:
    """Full names of the public modules in a package of ours and in those within; looked up once a process."""
    walked = pkgutil.walk_packages(import_module(package).__path__, f"{package}.")
    return tuple(found.name for found in walked if not found.ispkg and "._" not in found.name)


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] in CODE


def _name(origin: Origin) -> str:
    return origin.stem if isinstance(origin, Path) else origin.rpartition(".")[2]


def _origin(file: Path) -> Origin:
    """The file, or the full name of the module where it is one of ours."""
    file = file.absolute()
    return ".".join(file.with_suffix("").relative_to(ROOT).parts) if is_ours(file) else file


def _module(origin: Origin) -> ModuleType:
    """The module; what goes wrong in one of ours is an error of the program, in another a user's."""
    if not isinstance(origin, Path) and _is_ours(origin):
        return import_module(origin)
    try:
        return load(origin) if isinstance(origin, Path) else import_module(origin)
    except InputError:
        raise
    except Exception as error:
        reason = _reason(error, _name(origin))
        raise InputError(f"plug-in '{origin}' cannot be imported: {reason}; mend it or take it away") from error


def _reason(error: Exception, name: str) -> str:
    """What was raised, and in which line of the module `name`, or of what it calls where it is not there."""
    if isinstance(error, SyntaxError):
        return f"{error.msg} ({Path(error.filename or '').name}, line {error.lineno})"
    frames = traceback.extract_tb(error.__traceback__)
    *_, last = [frame for frame in frames if Path(frame.filename).stem == name] or frames
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"
