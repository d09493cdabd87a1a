"""YAML from strangers: safe loader only, with limits on size, nesting and aliases, and no key twice."""

import re
from typing import Any

import yaml

from railsim.errors import InputError

MOST_CHARACTERS = 1_000_000
MOST_NODES = 200_000
"""Nodes after every alias is written out: nested aliases grow without bound ("billion laughs")."""
DEEPEST = 50
_EXPONENT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$")
"""Numbers with an exponent, of which YAML 1.1 takes those without a dot and a sign for text."""


def load_yaml(text: str, where: str) -> Any:
    """Plain values of a YAML text.

    Parameters
    ----------
    text : the text of one document.
    where : what it is, in front of messages.

    Raises
    ------
    InputError : not YAML, an unsafe tag, a key that appears twice, too large, too deep or too many aliases.
    """
    if len(text) > MOST_CHARACTERS:
        raise InputError(f"{where} has {len(text)} characters, more than {MOST_CHARACTERS}; is it the right file?")
    try:
        _check_depth(text, where)
        node = yaml.compose(text, Loader=_Loader)
        if node is None:
            return None
        _check_node(node, where, {})
        return _Loader("").construct_document(node)
    except yaml.YAMLError as error:
        raise InputError(f"{where} is not YAML: {first_line(error)}") from None
    except (ValueError, OverflowError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where} holds a value that YAML cannot read: {error}; put it in quotes") from None


def dump_yaml(values: Any) -> str:
    """Text of which `load_yaml` makes the same plain values again; keys keep their order."""
    return yaml.dump(values, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120)


def first_line(error: yaml.YAMLError) -> str:
    """What is wrong, and in which line."""
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or " ".join(str(error).split()) or "empty or unreadable"
    return f"{problem} (line {mark.line + 1})" if mark else problem


class _Loader(yaml.SafeLoader):
    """The safe loader, which makes nothing but plain values; 14e3 and 1E-6 are numbers, as in YAML 1.2."""


class _Dumper(yaml.SafeDumper):
    """Puts a text that the loader would take for a number in quotes."""


for _side in (_Loader, _Dumper):
    _side.add_implicit_resolver("tag:yaml.org,2002:float", _EXPONENT, list("-+.0123456789"))


def _check_depth(text: str, where: str) -> None:
    """Count nesting over the events, before anything that recurses sees the text."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > DEEPEST:
                raise InputError(f"{where} nests deeper than {DEEPEST} levels; flatten it")
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _check_node(node: yaml.Node, where: str, sizes: dict[int, int]) -> int:
    """Number of nodes below and with this one, aliases written out; a key twice or a node in itself is refused."""
    known = sizes.get(id(node))
    if known is not None:
        if known == 0:
            raise InputError(f"{where}: an alias stands for something that holds it; write it out")
        return known
    sizes[id(node)] = 0
    count = 1
    if isinstance(node, yaml.MappingNode):
        _check_keys(node, where)
        count += sum(_check_node(part, where, sizes) for pair in node.value for part in pair)
    elif isinstance(node, yaml.SequenceNode):
        count += sum(_check_node(part, where, sizes) for part in node.value)
    if count > MOST_NODES:
        raise InputError(f"{where} has more than {MOST_NODES} values once its aliases are written out; shorten it")
    sizes[id(node)] = count
    return count


def _check_keys(node: yaml.MappingNode, where: str) -> None:
    seen: set[str] = set()
    for key, _ in node.value:
        if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
            if key.value in seen:
                raise InputError(f"{where} line {key.start_mark.line + 1}: key '{key.value}' appears twice; keep one")
            seen.add(key.value)
