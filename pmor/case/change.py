"""A case with some keys changed: what studies and benchmarks are made of."""

import json
import tomllib
from collections.abc import Mapping
from typing import Any


def changed_text(base: str, changes: Mapping[str, Mapping[str, Any]]) -> str:
    r"""Return the TOML text of a case with some keys changed; comments are lost.

    Parameters
    ----------
    base : str
        TOML text of a case.
    changes : mapping
        New values by section and key.

    Examples
    --------
    >>> print(changed_text('[mesh]\nprofile_elements = 16', {"mesh": {"profile_elements": 8}}).strip())
    [mesh]
    profile_elements = 8
    """
    document: dict[str, Any] = tomllib.loads(base)
    for name, keys in changes.items():
        document[name] = document.get(name, {}) | dict(keys)
    # A case has keys outside of sections first, then one level of sections with plain values.
    plain = {key: value for key, value in document.items() if not isinstance(value, dict)}
    lines = [f"{key} = {_toml(value)}" for key, value in plain.items()]
    for name, keys in document.items():
        if isinstance(keys, dict):
            lines += ["", f"[{name}]", *(f"{key} = {_toml(v)}" for key, v in keys.items())]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    # JSON writes what a case file holds as TOML does; the rest becomes text, which the case file's rules refuse.
    return json.dumps(value, ensure_ascii=False, default=str)
