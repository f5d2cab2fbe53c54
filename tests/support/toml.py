"""A dictionary as TOML, as files of gearboxes and sets are read: for tests that change one and write it anew."""

import json
import tomllib


def parsed(text):
    """Read a TOML text."""
    return tomllib.loads(text)


def toml(document):
    """Write a dictionary as TOML: each key on a line of its own, sections and lists inline."""
    return "".join(f"{key} = {_value(value)}\n" for key, value in document.items())


def _value(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value)
