"""What a user of Python holds: public classes, what public functions return, and what these give in turn."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterator
from functools import cache, cached_property
from importlib import import_module
from types import ModuleType
from typing import Any

import pmor
from pmor.app.records import KINDS, called


def held() -> dict[type, str]:
    """Return all classes whose objects public names give, each by where it is from."""
    found: dict[type, str] = {}
    for name in pmor.__all__:
        item = getattr(pmor, name)
        if not inspect.isclass(item):
            found |= dict.fromkeys(_returned(item), name) if callable(item) else {}
        elif not issubclass(item, BaseException):
            found[item] = name
    for kind in list(found):
        for name, function in _members(kind):
            found |= {one: f"{kind.__name__}.{name}" for one in _returned(function) if one not in found}
    for file in KINDS.values():
        found |= dict.fromkeys(_returned(called(file.load)), "load")
    return found


def _members(kind: type) -> Iterator[tuple[str, Any]]:
    for name in dir(kind):
        member = inspect.getattr_static(kind, name)
        if not name.startswith("_") and isinstance(member, property | cached_property):
            yield name, member.fget if isinstance(member, property) else member.func
        elif not name.startswith("_") and inspect.isfunction(member):
            yield name, member


@cache
def _imports(module: ModuleType) -> dict[str, tuple[str, str]]:
    return {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(ast.parse(inspect.getsource(module)))
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("pmor")
        for alias in node.names
    }


def _returned(function: Any) -> Iterator[type]:
    """Yield the classes of this program in the annotation of what a function returns, in whichever room it imports."""
    function = inspect.unwrap(function)
    module = sys.modules[function.__module__]
    imports = _imports(module)
    for word in re.findall(r"\w+", str(function.__annotations__.get("return", ""))):
        home, name = imports.get(word, (module.__name__, word))
        item = getattr(import_module(home), name, None)
        if inspect.isclass(item) and item.__module__.startswith("pmor"):
            yield item
