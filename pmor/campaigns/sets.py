"""Designs that are planetary sets: the figures of each are, to the last bit, those of `pmor run` of its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from pmor.campaigns.kind import Kind, Solved
from pmor.campaigns.set_figures import FIGURES, FIRST, figures_of, peaks_of
from pmor.campaigns.set_relations import KNOWN, text_of_design, why_infeasible, with_relations
from pmor.campaigns.settings import SetCampaign, SetRelations
from pmor.campaigns.store import Store
from pmor.case.capability import rule_of
from pmor.core.errors import CaseError
from pmor.rexs.files import load_set, read_sections
from pmor.sets.layout import SECOND_PLANET
from pmor.sets.loader import SetFile, parse_set
from pmor.sets.preview import PAGE, refuse_large_set, stages_of_set
from pmor.sets.run import solved, train_of
from pmor.work.cost import CASELESS


def _base_text(base: Path, relations: SetRelations, fixed: Mapping[str, Any], place: str) -> str:
    # Relations may make gears fit that do not as the file has them: designs are put together with these alone.
    text, said = read_sections(base) if relations != SetRelations() else ("", None)
    if said is None:
        file = load_set(base)
        text, said = file.text, file.sections

    def refuse(what: str, rule: str) -> NoReturn:
        raise CaseError(f"{place}: {what}: {rule}")

    if said.gears:
        refuse(str(base), rule_of("SetFile", "campaign"))
    if said.carrier.stiffness is not None:
        rule = "a matrix is of one number of planets and one centre distance: leave it out there"
        refuse(f"{base}: [carrier] stiffness", rule)
    if relations.centre_distance_mm is not None and relations.solve is not None:
        rule = "with centre_distance_mm the shifts of sun and ring are found both: leave it out"
        refuse(f'[relations] solve = "{relations.solve}"', rule)
    for key in ("planet_teeth_fewer", "ring_diameter_mm") if SECOND_PLANET in said.members else ():
        if getattr(relations, key) is not None:
            refuse(f"[relations] {key}", f"is of planets with one gear, and {base} has stepped ones: leave it out")
    return text_of_design(text, fixed)


def _file(text: str, name: str) -> SetFile:
    """The set of a design, without its tolerances."""
    file = parse_set(text, name, name)
    return replace(file, sections=replace(file.sections, tolerances=None))


def _refuse(text: str, name: str) -> None:
    refuse_large_set(_file(text, name))


def _seconds(text: str, name: str) -> float:
    return sum(stage.seconds for stage in stages_of_set(_file(text, name)) if stage.name not in (*CASELESS, PAGE))


def _solve(text: str, name: str, store: Store, keys: tuple[str, ...]) -> Solved:
    file = _file(text, name)
    refuse_large_set(file)
    result = solved(file, lambda member: store.get)
    return Solved(figures_of(file, result.data), next(iter(result.failures), ""))


def _peaks(text: str, name: str, store: Store) -> Mapping[str, float]:
    file = _file(text, name)
    return peaks_of(file, train_of(file, lambda member: store.get))


SETS = Kind(
    key="set", gear="sun", sections=SetCampaign, known=KNOWN, figures=FIGURES, first=FIRST, base_text=_base_text,
    complete=with_relations, text=text_of_design, why=why_infeasible, refuse=_refuse, seconds=_seconds, solve=_solve,
    peaks=_peaks,
)  # fmt: skip
