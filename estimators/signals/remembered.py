"""Designs that depend on a data sheet and settings alone are made once, however many recordings they serve."""

import copy
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import wraps
from threading import Lock
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])
MOST = 32  # results of one function that are kept


def remembered(function: F) -> F:
    """The function, whose last `MOST` results are kept by the values of its arguments.

    Each call gets a copy of its own, so that nobody changes what others get. What is raised is raised again each time.
    Arguments are numbers, texts, arrays, sequences, mappings and data classes of these.
    """
    kept: OrderedDict[Any, Any] = OrderedDict()
    lock = Lock()

    @wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        key = _key((arguments, named))
        with lock:
            found = kept.get(key)
            if found is not None:
                kept.move_to_end(key)
                return copy.deepcopy(found[0])
        result = function(*arguments, **named)
        with lock:
            kept[key] = (copy.deepcopy(result),)
            while len(kept) > MOST:
                kept.popitem(last=False)
        return result

    return cast(F, call)


def _key(value: Any) -> Any:
    """Something hashable that is equal for equal values of the same kind only."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, Mapping):
        return dict, tuple((name, _key(one)) for name, one in value.items())
    if isinstance(value, list | tuple):
        return type(value), tuple(_key(one) for one in value)
    if is_dataclass(value):
        return type(value), tuple(_key(getattr(value, field.name)) for field in fields(value))
    return type(value), repr(value) if isinstance(value, float) else value
