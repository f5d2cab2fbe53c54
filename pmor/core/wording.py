"""Remedies in the words of their reader: keywords in Python, sections and keys in files, options in a command.

Rules of files are worded for files, everything else for Python. The two doors between translate: `make_case` with
`in_python`, the command with `in_command`.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Sequence
from functools import wraps
from inspect import Parameter, signature
from os import PathLike
from typing import Any, TypeVar

from pmor.core.errors import CaseError, printable

Thing = TypeVar("Thing", bound=Callable[..., Any])
# Words of which at least so many letters belong to a longer one: "width" to face_width_mm.
LONG_ENOUGH = 4
MOST_SHOWN = 24
# What the first argument of these names is, and what to pass.
TAKES = {
    "case": ("a case", "pass pmor.load_case({})"), "model": ("a model", "pass pmor.load_model({})"),
    "file": ("the name of a file, or what its reader returned", 'write it as text, such as "gearbox.toml"'),
    "source": ("a model or the name of a file", "pass pmor.load_model({})"),
    "path": ("the name of a file", 'write it as text, such as "pair.toml"'),
}  # fmt: skip
OPTIONS = {
    "pass overwrite=True": "add --overwrite",
    "pass stage=": "choose one with --stage ",
    "pmor.train": "'pmor offline'",
    "pmor.load_model": "'pmor online'",
    "pmor.run_case": "'pmor run' or 'pmor online'",
    "run pmor.run_design first": "run 'pmor design' without --case first",
    "pmor.run_design": "'pmor design'",
    "pmor.campaign": "'pmor campaign'",
}
# Arguments that may be names of files.
NAMING = ("file", "path", "source")
# Modules whose objects are no case, model or settings.
PLAIN = ("builtins", "numpy")
_VALUE = r"""("[^"]*"|\[[^\]]*\]|\.\.\.|[^\s:,;]+)"""
_SECTION = r"\[+([a-z]+(?:\.[a-z]+)*)\]+"


def did_you_mean(word: str, valid: Sequence[str]) -> str:
    """Remedy for a misspelt word: the closest valid ones, or all of them."""
    closest = difflib.get_close_matches(word, valid, n=1)
    if not closest:  # "Teeth", "HERMITE"
        closest = [name for name in valid if name.lower() == word.lower()]
    if not closest and len(word) >= LONG_ENOUGH:
        closest = [name for name in valid if word.lower() in name.lower()][:3]
    if closest:
        return f"did you mean {' or '.join(closest)}?"
    return f"valid are {', '.join(valid[:MOST_SHOWN])}{', ...' if len(valid) > MOST_SHOWN else ''}"


def in_command(text: str) -> str:
    """Return a message of the library in the words of the command."""
    for keyword, option in OPTIONS.items():
        text = text.replace(keyword, option)
    return text


def in_python(text: str) -> str:
    r"""Return a message about a case file in the words of `make_case`.

    Examples
    --------
    >>> in_python('case: [mesh] element = "hex9": unknown choice')
    'case: mesh={\'element\': "hex9"}: unknown choice'
    """
    text = re.sub(rf"add '(\w+) = \.\.\.' below {_SECTION}", _missing, text)
    text = re.sub(r"write \[\[(\w+)\]\], brackets doubled", r"pass \1=[{...}, ...]", text)
    text = re.sub(rf"{_SECTION} (\w+) = {_VALUE}", lambda m: _keyword(m[1], f"'{m[2]}': {_literal(m[3])}"), text)
    text = re.sub(rf"{_SECTION} (?!and |with |or )(\w+)", lambda m: _keyword(m[1], f"'{m[2]}': ..."), text)
    text = re.sub(rf"\b(write|add|or) (\w+) = {_VALUE}", lambda m: f"{m[1]} {m[2]}={_literal(m[3])}", text)
    return text.replace("true or false, without quotes", "True or False").replace("write true", "write True")


def _missing(match: re.Match[str]) -> str:
    key, section = match.groups()
    # A key of the pinion alone is one of both gears.
    return f"pass {key}=..." if section != "wheel" else f"pass {_keyword(section, f'{key!r}: ...')}"


def _keyword(section: str, content: str) -> str:
    outer, _, inner = section.partition(".")
    return f"{outer}={{'{inner}': {{{content}}}}}" if inner else f"{outer}={{{content}}}"


def _literal(value: str) -> str:
    return {"true": "True", "false": "False"}.get(value, value)


def suggesting(thing: Thing) -> Thing:
    """Let a function, or the making of a class, name the closest of its keywords where it is given one that it lacks.

    A first argument of another kind is refused: a file in the place of the case or the model that is made from it with
    the function that reads it, a list or a number in the place of a file.

    Raises
    ------
    TypeError
        As Python does, and with what to type.
    """
    makes = isinstance(thing, type)
    function: Any = thing.__init__ if makes else thing  # type: ignore[misc]
    parameters = list(signature(function).parameters.values())
    open_end = any(p.kind is Parameter.VAR_KEYWORD for p in parameters)
    names = [p.name for p in parameters if p.name != "self" and p.kind is not Parameter.VAR_KEYWORD]
    bound = len(parameters) > 0 and parameters[0].name == "self"
    known, first = frozenset(names), names[0] if names else ""

    @wraps(function)
    def checked(*given: Any, **keywords: Any) -> Any:
        if not (open_end or keywords.keys() <= known):
            wrong = next(key for key in keywords if key not in known)
            raise TypeError(f"{thing.__name__}() has no keyword {wrong}: {did_you_mean(wrong, names)}")
        if first in TAKES and (len(given) > bound or first in keywords):
            _check_first(thing.__name__, first, given[bound] if len(given) > bound else keywords[first])
        return function(*given, **keywords)

    if not makes:
        return checked  # type: ignore[return-value]
    thing.__init__ = checked  # type: ignore[method-assign]
    return thing


def typed_out(keywords: Any, **defaults: Any) -> Callable[[Thing], Thing]:
    """Show each key of a TypedDict in the signature of a function, where notebooks find what to complete."""

    def shown_by(function: Thing) -> Thing:
        shown = signature(function)
        given = [parameter for parameter in shown.parameters.values() if parameter.kind is not Parameter.VAR_KEYWORD]
        keys = [
            Parameter(key, Parameter.KEYWORD_ONLY, default=defaults.get(key, ...),
                      annotation=getattr(hint, "__forward_arg__", hint))
            for key, hint in keywords.__annotations__.items()
        ]
        function.__signature__ = shown.replace(parameters=[*given, *keys])  # type: ignore[attr-defined]
        return function

    return shown_by


def _check_first(function: str, name: str, value: Any) -> None:
    """Raise TypeError where the first argument of a function is plainly not what its name says.

    CaseError where it is the name of a file that no file can have.
    """
    named = isinstance(value, str | PathLike)
    ours = type(value).__module__.split(".")[0] not in PLAIN
    if named and name in NAMING:
        if "\0" in str(value):
            raise CaseError(f"{printable(str(value))}: cannot be read, the name holds a null byte: check the path")
        return
    if ours and not named and name != "path":
        return
    shown = repr(str(value)) if named else f"{value!r:.40}"
    kind, remedy = TAKES[name]
    raise TypeError(f"{function}({shown}): takes {kind}: {remedy.format(shown if named else '...')}")
