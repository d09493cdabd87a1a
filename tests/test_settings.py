"""YAML from strangers: limits and the safe loader."""

import pytest

from railsim.errors import InputError
from railsim.settings import MOST_CHARACTERS, dump_yaml, load_yaml

LAUGHS = "a0: &a0 [x,x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]\n" for i in range(1, 30))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("x: !!python/object/apply:os.system ['true']", "could not determine a constructor"),
        (LAUGHS, "values once its aliases are written out"),
        ("a: &a [*a]", "holds it; write it out"),
        ("[" * 5000, "nests deeper than 50 levels"),
        ("a: 1\na: 2", "line 2: key 'a' appears twice"),
        ("a: 2024-13-45", "holds a value that YAML cannot read"),
        ("a: [1", "is not YAML"),
        ("a: \x00", "is not YAML"),
        ("? [1, 2]\n: 3\n", "is not YAML"),
        ("x" * (MOST_CHARACTERS + 1), "characters, more than"),
    ],
)
def test_dangerous_or_broken_text_is_one_clear_line(text: str, line: str):
    with pytest.raises(InputError, match=line) as caught:
        load_yaml(text, "map")
    assert "\n" not in str(caught.value)


def test_plain_values_and_aliases():
    assert load_yaml("a: &x [1, 2.5, null]\nb: *x\nc: {d: yes}\n", "map") == {
        "a": [1, 2.5, None],
        "b": [1, 2.5, None],
        "c": {"d": True},
    }
    assert load_yaml("base: &b {u: 1}\nmore: {<<: *b, v: 2}\n", "map")["more"] == {"u": 1, "v": 2}
    assert load_yaml("", "map") is None


@pytest.mark.parametrize("text", ["14e3", "14e+3", "1.4E4", "+14e3", "14.e3", ".014e6", "1.4e+04"])
def test_numbers_as_people_write_them_are_numbers(text: str):
    assert load_yaml(f"a: [{text}, '{text}']", "map") == {"a": [14000.0, text]}


@pytest.mark.parametrize("text", ["1e5", "-1E-3", ".5e1", "e5", "1e", "14e3 kg", "v1e3", "true", "0x1f", "1.5"])
def test_what_is_written_is_read_again(text: str):
    values = {"text": text, "number": 1e-7, "list": [1e22, 3, None, True]}
    assert load_yaml(dump_yaml(values), "map") == values
