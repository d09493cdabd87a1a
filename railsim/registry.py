"""Plug-ins are found, not listed: one file is one plug-in, and its module name is its name."""

import importlib
import inspect
import pkgutil
from types import ModuleType
from typing import TypeVar

from railsim.errors import InputError

T = TypeVar("T")


def modules(package: ModuleType) -> dict[str, ModuleType]:
    """Every public module of `package` and of the packages in it, by full name, in the order of the modules' own names.

    Names with a leading underscore are private helpers.
    """
    walked = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    names = [found.name for found in walked if not found.ispkg and "._" not in found.name]
    return {name: importlib.import_module(name) for name in sorted(names, key=lambda name: name.rpartition(".")[2])}


def discover(package: ModuleType, base: type[T]) -> dict[str, type[T]]:
    """The one subclass of `base` that each module of `package` defines, by module name.

    Modules that define none (the interface itself, for example) are passed over.

    Raises
    ------
    TypeError : a module defines more than one public concrete subclass, or two modules have the same name.
    """
    found = {}
    for full_name, module in modules(package).items():
        own = [
            value
            for value in vars(module).values()
            if inspect.isclass(value)
            and issubclass(value, base)
            and value is not base
            and value.__module__ == module.__name__
            and not value.__name__.startswith("_")
            and not inspect.isabstract(value)
        ]
        if len(own) > 1:
            raise TypeError(f"{module.__name__} defines {len(own)} plug-ins; one file holds one")
        if own:
            name = full_name.rpartition(".")[2]
            if name in found:
                raise TypeError(f"{full_name} and {found[name].__module__} have the same name; rename one of the files")
            found[name] = own[0]
    return found


def pick(found: dict[str, T], name: str, what: str) -> T:
    """Entry `name`; raise `InputError` that lists what there is otherwise."""
    if name not in found:
        raise InputError(f"unknown {what} '{name}'; there are: {', '.join(sorted(found)) or 'none'}")
    return found[name]
