"""The keywords of cases in Python are typed out: those of the schema, each with its type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from inspect import signature
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest

import pmor
from pmor.app.cases import Settings
from pmor.case.document import CONDITION
from pmor.case.reader import keys_of
from pmor.case.schema import SECTIONS
from pmor.core.errors import CaseError

SINGLE = ("title", CONDITION, *(name for name in SECTIONS if "." not in name))


def single_keys():
    """Keys that need no section, with their annotations in the schema."""
    found = {}
    for kind in SECTIONS.values():
        for key, hint in keys_of(kind).items():
            try:
                pmor.make_case(**{key: object()})
            except CaseError as error:
                if "more than one section" not in str(error):
                    found[key] = hint
    return found


def taken(hint):
    """What a key takes in Python, of its annotation in the schema."""
    if get_origin(hint) in (UnionType, Union):
        return Union[tuple(taken(one) for one in get_args(hint) if one is not NoneType)]  # noqa: UP007
    if get_origin(hint) is Annotated:
        return taken(get_args(hint)[0])
    if get_origin(hint) is tuple:
        from collections.abc import Sequence

        return taken(get_args(hint)[0]) | Sequence[taken(get_args(hint)[0])]
    return Mapping[str, Any] if is_dataclass(hint) else hint


def test_the_keywords_are_the_keys_of_the_schema_with_their_types():
    typed = get_type_hints(Settings)
    assert {key: hint for key, hint in typed.items() if key not in SINGLE} == {
        key: taken(hint) for key, hint in single_keys().items()
    }
    assert set(SINGLE) <= typed.keys()


@pytest.mark.parametrize(("function", "first"), [(pmor.make_case, "name"), (pmor.change_case, "case")])
def test_a_notebook_finds_them_in_the_signature(function, first):
    assert list(signature(function).parameters) == [first, *Settings.__annotations__]
    element = signature(function).parameters["element"]
    assert element.kind is element.KEYWORD_ONLY
    assert get_args(eval(element.annotation, {"Literal": Literal})) == ("hex20", "hex8i", "hex8")
