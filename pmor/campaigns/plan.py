"""Plan of a campaign: how many designs, which of them cannot be made and why, how long they take; solves nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

from pmor.campaigns.campaign import Campaign, Span, Variable
from pmor.campaigns.chunks import chunks_of, expected_cost
from pmor.campaigns.fine import BEST
from pmor.campaigns.kind import PEAKS, Design
from pmor.campaigns.page import common_reasons
from pmor.campaigns.rows import NAME
from pmor.campaigns.table import designs_of, different_designs
from pmor.case.values import toml_text
from pmor.core.errors import CaseError, GeometryError, InsufficientMemoryError, MeshError
from pmor.core.progress import format_time
from pmor.work.cost import START_S, Plan, compiling_seconds, plan_texts

# *Measured*, seconds: of page and pictures.
PAGE_S = 3.0
# Designs whose geometry is checked, evenly over all; values and reasons that are listed.
MOST_CHECKED, FEW_VALUES, COMMON_REASONS = 1_000, 6, 8


def plan(campaign: Campaign) -> Plan:
    """Return the plan of a campaign; processes share its time."""
    numbers, _ = different_designs(campaign)
    count = len(numbers)
    one = expected_cost(campaign, designs_of(campaign))
    judged = one.finely * min(count * one.share, BEST + 1) if set(PEAKS) & set(campaign.results) else 0.0

    def parts() -> Iterator[str]:
        work = _work(campaign, count, one.seconds, judged)
        yield from plan_texts(_designs(campaign, count), _feasible(campaign, numbers.tolist()), work)

    seconds = {"campaign": 2.0 * START_S + count * one.seconds + judged + PAGE_S}
    return Plan(parts, seconds, compiling_seconds())


def _designs(campaign: Campaign, different: int) -> list[str]:
    said, relations = campaign.sections, campaign.sections.relations
    again = f", {different} of them different: each is solved once" if different < campaign.count else ""
    width = max(len(variable.name) for variable in campaign.variables)
    base = f"{campaign.kind.key} {campaign.inputs[1].name}"
    lines = [
        f"Campaign {campaign.name}: {said.title}",
        f"  {campaign.count} designs of the {base}, {said.designs.method}{again}",
        *(f"  {variable.name:<{width}}  {_values(variable)}" for variable in campaign.variables),
    ]
    given = ", ".join(
        f"{field.name} = {toml_text(value)}"
        for field in fields(relations)
        if (value := getattr(relations, field.name)) != field.default
    )
    if given:
        follow = f"{', '.join(relations.derived)}: from " if relations.derived else ""
        lines.append(f"  {follow}[relations] {given}")
    return lines if said.results == type(said.results)() else [*lines, f"  results: {', '.join(campaign.results)}"]


def _values(variable: Variable) -> str:
    values = variable.values
    if isinstance(values, Span):
        return f"from {values.low:g} to {values.high:g}"
    if len(values) <= FEW_VALUES:
        return ", ".join(f"{value:g}" for value in values)
    return f"{len(values)} values from {min(values):g} to {max(values):g}"


def _feasible(campaign: Campaign, numbers: list[int]) -> list[str]:
    table, step = designs_of(campaign), -(-len(numbers) // MOST_CHECKED)
    checked = numbers[::step]
    reasons = [why_not(campaign, number, table(number)) for number in checked]
    common = common_reasons(reasons)
    none = sum(map(len, common))
    part = "" if step == 1 else f", one design in {step} looked at"
    lines = [f"Geometry, loads and memory{part}", f"  {len(checked) - none} of {len(checked)} designs can be made"]
    lines += [
        f"  {len(group)}, such as design {checked[group[0]] + 1}: {reasons[group[0]]}"
        for group in common[:COMMON_REASONS]
    ]
    if len(common) > COMMON_REASONS:
        lines.append(f"  and {len(common) - COMMON_REASONS} more reasons")
    return lines


def why_not(campaign: Campaign, number: int, design: Design) -> str:
    """Return why a design cannot be made, as far as this shows before it is meshed; empty where nothing does."""
    complete, relations, kind, name = dict(design), campaign.sections.relations, campaign.kind, f"{NAME} {number + 1}"
    try:
        complete = kind.complete(campaign.base_text, design, relations)
        kind.refuse(kind.text(campaign.base_text, complete), name)
    except InsufficientMemoryError as error:
        return str(error)
    except (CaseError, GeometryError, MeshError) as error:
        return kind.why(str(error).removeprefix(f"{name}: "), campaign.base_text, complete, relations)
    return ""


def _work(campaign: Campaign, different: int, seconds: float, judged: float) -> list[str]:
    chunks = chunks_of(different, seconds)
    limit, one = campaign.sections.workers, format_time(seconds) if seconds > 1.0 else f"{seconds:.1g} s"
    return [
        "Work",
        f"  about {one} of one processor for a design on average, over --jobs N",
        f"  {len(chunks)} chunks, each kept when it is finished; {limit.time_limit_s:g} s at most for a design",
        *([f"  the best ones on fine angles, about {format_time(judged)}"] if judged else []),
    ]
