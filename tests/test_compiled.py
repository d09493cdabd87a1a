"""Machine code is kept by all source that it is made of, and by no more."""

import gc
import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numba.core import event
from numba.core.dispatcher import Dispatcher

import estimators
import railsim
from railsim.compiled import source_digest, sources


def modules() -> Iterator[ModuleType]:
    for package in (railsim, estimators):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            path = Path(package.__path__[0], *found.name.split(".")[1:]).with_suffix(".py")
            if path.is_file() and b"from railsim.compiled import" in path.read_bytes():
                yield importlib.import_module(found.name)


def kernels(module: ModuleType) -> Iterator[Any]:
    """Functions of a module that are compiled there."""
    for one in vars(module).values():
        if isinstance(one, Dispatcher) and one.py_func.__module__ == module.__name__:
            yield one


def called(one: Any) -> Iterator[Any]:
    for name in one.py_func.__code__.co_names:
        other = one.py_func.__globals__.get(name)
        if isinstance(other, Dispatcher):
            yield other


def file_of(one: Any) -> Path:
    return Path(one.py_func.__code__.co_filename)


def test_every_kernel_that_is_called_counts_to_the_caller() -> None:
    seen = 0
    for module in modules():
        for one in kernels(module):
            reached, ahead = set[Path](), [one]
            while ahead:
                more = [other for other in called(ahead.pop()) if file_of(other) not in reached]
                reached |= {file_of(other) for other in more}
                ahead += more
            assert reached <= sources(file_of(one)), one
            assert source_digest(file_of(one)) in str(one.stats.cache_path)
            seen += len(reached)
    assert seen > 50


@pytest.mark.parametrize("name", ["filters/dropout_filter", "wheel_rail/contact_filter", "speed/travel_time"])
def test_an_estimator_does_not_compile_the_engines_again(name: str) -> None:
    engine = sources(Path(railsim.__path__[0], "dynamics", "kernel.py"))
    own = sources(Path(estimators.__path__[0], f"{name}.py"))
    assert not {path for path in engine if "estimators" in path.parts}
    assert not {path for path in own if {"dynamics", "engines"} & set(path.parts)}


@pytest.mark.parametrize("name", ["estimators.wheel_rail.conicity_kernel", "estimators.wheel_rail.gauge_kernel"])
def test_the_run_that_compiles_has_the_machine_code_of_later_ones(name: str) -> None:
    """Called as a function, a kernel's own copy is used in the process that compiles it, and from the cache one that
    was optimised with its caller: sums are reassociated otherwise. Copied into the caller there is one code only.
    """
    seen = 0
    for one in kernels(importlib.import_module(name)):
        for other in called(one):
            assert other.targetoptions.get("forceinline"), f"{one.__name__} calls {other.__name__}: make it `inlined`"
            seen += 1
    assert seen > 2


def test_nobody_looks_for_garbage_while_a_kernel_is_compiled():
    """Nested kernels too; afterwards, and where somebody has turned it off, all is as before."""
    assert gc.isenabled()
    with event.trigger_event("numba:compile"):
        with event.trigger_event("numba:compile"):
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()
    gc.disable()
    try:
        with event.trigger_event("numba:compile"):
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
