"""A design on half as many elements: where finite elements take long, its first result does not wait for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pmor.case import Case
from pmor.case.models import halved
from pmor.case.width import elements_across
from pmor.design.files import PairDesign, SetDesign


def coarse_design(file: PairDesign | SetDesign) -> PairDesign | SetDesign | None:
    """Return a design whose gears have half as many elements over profile and width; None where there are no such.

    They have no stress at the roots.
    """
    if "root_stress_MPa" in file.design.results:
        return None
    if isinstance(file, SetDesign):
        cases = _halved(file.set.cases)
        return None if cases is None else replace(file, set=replace(file.set, cases=cases))
    cases = _halved(file.cases)
    if cases is None:
        return None
    if file.box is None:
        return replace(file, case=cases[file.case.name])
    return replace(file, case=cases[file.mesh], box=replace(file.box, cases=cases))


def _halved(cases: Mapping[str, Case]) -> dict[str, Case] | None:
    found = dict[str, Case]()
    for name, case in cases.items():
        fewer = halved(case)
        if fewer is None or elements_across(fewer) > elements_across(case):
            return None
        found[name] = fewer
    return found
