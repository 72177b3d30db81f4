"""A dictionary as TOML, for the library's own readers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._errors import InputError
from ._units import as_text, kind_of


def dump(tables: Mapping[str, Any]) -> str:
    """The text of a mapping. Tables of the first level get headers; what lies deeper stands in line."""
    plain: list[str] = []
    below: list[str] = []
    for name, value in _items(tables, ""):
        if isinstance(value, Mapping):
            below += ["", f"[{_name(name)}]", *_lines(value, name)]
        elif _is_list_of_tables(value):
            for index, table in enumerate(value):
                below += ["", f"[[{_name(name)}]]", *_lines(table, f"{name}[{index}]")]
        else:
            plain.append(f"{_name(name)} = {_value(value, name)}")
    return "\n".join(plain + below) + "\n"


def _lines(table: Mapping[str, Any], key: str) -> list[str]:
    return [f"{_name(name)} = {_value(value, f'{key}.{name}')}" for name, value in _items(table, key)]


def _items(table: Mapping[str, Any], key: str) -> list[tuple[str, Any]]:
    for name in table:
        if not isinstance(name, str):
            raise InputError(f"`{key}`: {name!r} is no key; give a text", key or None)
    return [(name, value) for name, value in table.items() if value is not None]


def _is_list_of_tables(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _name(name: str) -> str:
    return name if name and all(c.isascii() and (c.isalnum() or c in "-_") for c in name) else _text(name)


def _text(text: str) -> str:
    escapes = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t", "\b": "\\b", "\f": "\\f"}
    parts = [escapes.get(c, f"\\u{ord(c):04X}" if ord(c) < 32 or ord(c) == 127 else c) for c in text]
    return '"' + "".join(parts) + '"'


def _value(value: Any, key: str) -> str:
    if kind_of(value) is not None:
        value = as_text(key, value)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        if not -(2**63) <= value < 2**63:
            raise InputError(f"`{key}`: is {value}; give a number of at most 64 bits", key)
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InputError(f"`{key}`: is {value}; give a finite number", key)
        return repr(value)
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            raise InputError(f"`{key}`: is no text that can be written", key) from None
        return _text(value)
    if isinstance(value, Mapping):
        pairs = [f"{_name(name)} = {_value(item, f'{key}.{name}')}" for name, item in _items(value, key)]
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item, f"{key}[{index}]") for index, item in enumerate(value)) + "]"
    raise InputError(f"`{key}`: is of type {type(value).__name__}; give a number, a text, a list or a dictionary", key)
