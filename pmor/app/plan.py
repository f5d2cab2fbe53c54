"""Plan of a case: settings, computed and skipped work with sizes, from the case and its mesh; nothing is solved.

A new part of the plan is one more function in `PARTS`: from the case to the lines it prints.
"""

from collections.abc import Callable, Iterator

from pmor.app.geometry import geometry
from pmor.app.skipped import computed, remarks, scene, skipped
from pmor.case import Case, condition_words, describe, model_names, other_models, short_list
from pmor.case.capability import left_out, why_not
from pmor.case.document import GEARS
from pmor.case.duty import shares
from pmor.case.width import asks_for_live_page, intervals_across, meshed_width, sections_across, takes_whole_width
from pmor.dynamics.cost import motion_seconds
from pmor.pair.conditions import full_solves, misalignments, torques_of
from pmor.pair.drawn import drawn_gears
from pmor.pair.model import gear_pair, refuse_loads_unmeshed
from pmor.report.blank_figure import section_text
from pmor.work.cost import COMPILING, Plan, plan_texts, refuse_beyond_memory, seconds_of, stage_lines, stages

NOT_WRITTEN = {
    "compare.models": "the case's own alone",
    "contact.edge_normals": "of the scheme",
    "dynamics.backlash_um": "of the nominal pair",
    "dynamics.mesh_damping_N_s_mm": "by the ratio",
    "dynamics.mesh_frequency_Hz": "by the ratio",
    "dynamics.speed_range_rpm": "by the ratio",
    **{f"dynamics.{gear}_{key}": "of the gear as drawn" for gear in GEARS for key in ("inertia_kg_m2", "mass_kg")},
    **{f"dynamics.{gear}_{key}": "rigid" for gear in GEARS
       for key in ("bearing_stiffness_N_um", "tilting_stiffness_kNm_rad")},
    **{f"dynamics.{gear}_bearing_damping_N_s_mm": "by the ratio" for gear in GEARS},
    "load.speed_rpm": "not given",
    "pair.centre_distance_mm": "without backlash",
    **{f"{gear}.blank.hub_width_mm": "of the face" for gear in GEARS},
    **{f"{gear}.blank.web_thickness_mm": "of its profile" for gear in GEARS},
    "pinion.face_width_mm": "of the pair",
    "wheel.face_width_mm": "of the pair",
}  # fmt: skip


def plan(case: Case) -> Plan:
    """Return the plan of a case: all settings with the defaults marked, sizes, the number of solves, and so on.

    Its parts raise CaseError between two of them when the case takes more memory than there is: the others would need a
    mesh.

    Raises
    ------
    GeometryError, MeshError
        When there is no such gear, pair or mesh.
    """
    found, motion = stages(case), motion_seconds(case)

    def parts() -> Iterator[str]:
        refuse_loads_unmeshed(case)  # before anything is printed
        yield from plan_texts(*(part(case) for part in PARTS), stage_lines(found))
        refuse_beyond_memory(case)
        yield from plan_texts(_computed_and_skipped(case))

    moved = {} if motion is None else {"dynamics": motion}
    return Plan(parts, {"run": seconds_of(found), **moved}, seconds_of(found, COMPILING))


def _heading(case: Case) -> list[str]:
    return [f"Case {case.name}: {case.title}", "Settings marked * are defaults that the case file does not mention."]


def _settings(case: Case) -> list[str]:
    lines = []
    section = ""
    for key, value, is_default in describe(case):
        if "." not in key:
            continue  # the title is in the heading
        name, _, entry = key.rpartition(".")
        if name != section:
            lines.append(f"[{name}]")
            section = name
        lines.append(f"  {entry:<22} {_value_text(key, value)}{' *' if is_default else ''}")
    return lines


def _geometry(case: Case) -> list[str]:
    return str(geometry(case)).splitlines()


def _blanks(case: Case) -> list[str]:
    """Sections of blanks by dimensions."""
    if not any(case.pair.blanks):
        return []
    drawn = zip(GEARS, drawn_gears(case, gear_pair(case)), strict=True)
    sections = [["", name, *section_text(gear)] for name, gear in drawn if gear.light]
    title = "Blanks by dimensions, from the tip down to the bore, z to the right (| teeth, # solid, . holes)"
    return [title, *(f"  {line}".rstrip() for section in sections for line in section)]


def _sizes(case: Case) -> list[str]:
    mesh, contact = case.mesh, case.contact
    along, across = mesh.profile_intervals, intervals_across(case)
    width = {"whole": "the width", "half": "half the width", "plane_strain": "the width"}[meshed_width(case)]
    flank_nodes = (along + 1) * (across + 1)
    grid = f"{along + 1} over the profile x {across + 1} over {width}"
    points = (along * contact.lodm_profile + 1) * (across * contact.lodm_width + 1)
    contact_points = (
        f"  contact points per flank       {points:>8}  "
        f"(LoDM {contact.lodm_profile} over the profile, {contact.lodm_width} over the width)"
    )
    if contact.kind == "line":
        sections = sections_across(case)
        contact_points = f"  {f'sections over {width}':<30} {sections:>8}  (a line load each, on exact flanks)"
    return [
        "Sizes", f"  flank nodes per tooth          {flank_nodes:>8}  ({grid})",
        f"  flank unknowns per tooth       {3 * flank_nodes:>8}", contact_points
    ]  # fmt: skip


def _work(case: Case) -> list[str]:
    online, compare = case.online, case.compare
    angles = online.angles_per_pitch * case.pitches
    stages = [
        ("offline, full contact solves", full_solves(case), _training_text(case)),
        ("online, reduced solves", *_sweep(angles, online.torques_Nm)),
        ("compare, full and reduced", *_sweep(compare.angles, compare.torques_Nm)),
    ]
    if case.reduction.shapes == "line_loads":
        stages.insert(2, ("online, Harris map", *_sweep(angles, case.results.harris_torques_Nm)))
    if case.conditions:
        stages.insert(2, ("online, conditions", *_listed(case)))
    if case.tolerances is not None:
        sampled = case.tolerances.samples * max(angles, _turn(case) if case.tolerances.of_teeth else 0)
        words = f"{case.tolerances.samples} pairs, {len(online.torques_Nm)} torques"
        stages.insert(2, ("online, tolerances", sampled * len(online.torques_Nm), words))
    rows = (f"  {label:<30} {solves:>8}  ({text})" for label, solves, text in stages)
    return ["Work", *rows, *_ranges(case), *_live_page(case)]


def _turn(case: Case) -> int:
    """Angles of a turn of the larger gear."""
    return case.online.angles_per_pitch * max(case.pair.pinion.teeth, case.pair.wheel.teeth)


def _live_page(case: Case) -> list[str]:
    if not asks_for_live_page(case):
        return []
    how = f"left out: {why}" if (why := why_not(case, "page")) else "solves line loads itself"
    more = "; takes finite elements of the whole width, in 'training' below" if takes_whole_width(case) else ""
    return [f"  {'live page':<30} {how}{more}"]


def _sweep(angles: int, torques: tuple[float, ...]) -> tuple[int, str]:
    return angles * len(torques), f"{angles} angles x {_torques_text(torques)}"


def _listed(case: Case) -> tuple[int, str]:
    """Solves of the conditions that a case lists, each at the torques of the sweep and at its own."""
    angles = case.online.angles_per_pitch * case.pitches
    torques = sum(len(torques_of(case, condition)) for condition in case.conditions)
    return angles * torques, f"{len(case.conditions)} conditions, {angles} angles x {torques} torques in all"


def _training_text(case: Case) -> str:
    """Sampling of the full solves: a grid, a sequence, or a search."""
    offline = case.offline
    if not case.reduction.trained:
        what = "line loads are exact" if case.reduction.shapes == "line_loads" else "static modes are unit forces"
        return f"{what}: nothing is trained"
    if offline.sampling == "sobol":
        return "states of a Sobol sequence, spread over angle and ranges"
    if offline.sampling == "greedy":
        begin = min(offline.angles_per_pitch, offline.solves)
        return f"at most: {begin} angles, then where the error bar is longest, to {offline.tolerance_percent:g} %"
    _, text = _sweep(offline.angles_per_pitch, offline.torques_Nm)
    count = misalignments(case)
    return text if count == 1 else f"{text} x {count} misalignments"


def _ranges(case: Case) -> list[str]:
    """Ranges of the parameters that a training spread over them covers."""
    offline = case.offline
    if offline.sampling == "grid" or not case.reduction.trained:
        return []
    ranges = (
        ("torque", offline.torques_Nm, "N m"), ("in plane", offline.in_plane_um, "um"),
        ("out of plane", offline.out_of_plane_um, "um"), ("centre distance", offline.centre_distance_um, "um"),
    )  # fmt: skip
    texts = [f"{name} {values[0]:g} to {values[-1]:g} {unit}" for name, values, unit in ranges if len(values) > 1]
    return [f"  {'ranges of the training':<30} {', '.join(texts)}"] if texts else []


def _computed_and_skipped(case: Case) -> list[str]:
    case_scene = scene(case)
    lines = ["Finite elements", *(f"  {what:<32} {how_much}" for what, how_much in computed(case_scene)), ""]
    lines.append("Left out: what, because, saves")
    for item in skipped(case_scene):
        lines += [f"  {item.what:<32} {item.why}", f"  {'':<32} saves {item.saving}"]
    lines += [f"  {what:<32} {why}" for what, why in left_out(case)]
    return [*lines, *(f"! {remark}" for remark in remarks(case_scene))]


def _conditions(case: Case) -> list[str]:
    """The conditions that a case lists beside its own, each with what its flanks are like."""
    lines = [
        f"  {condition.name:<22} {'; '.join([f'{condition.torque_Nm:g} N m', *condition_words(case, condition)])}"
        for condition in case.conditions
    ]
    return ["Conditions beside the case's own", *lines] if lines else []


def _loads(case: Case) -> list[str]:
    """The loads of a duty cycle."""
    lines = []
    for load, share in zip(case.loads, shares(case.loads) or [None] * len(case.loads), strict=True):
        rpm = load.speed_rpm or case.speed_rpm
        words = [f"{load.torque_Nm:g} N m", f"{rpm:g} rpm" if rpm else "", f"{100.0 * share:.3g} %" if share else ""]
        lines.append(f"  {load.name:<22} {', '.join(filter(None, words))}")
    return ["Duty cycle, and shares of the time", *lines] if lines else []


def _models(case: Case) -> list[str]:
    """The models that a case compares: contact scheme, shapes, work beside the finite elements."""
    cases = {case.contact.scheme: case, **dict(other_models(case))}
    lines = []
    for scheme in model_names(case):
        model = cases[scheme]
        whose = ", the case's own" if model is case else ""
        work = f"{full_solves(model)} full solves for its basis" if model.reduction.trained else "nothing is trained"
        lines.append(f"  {scheme:<22} {model.reduction.shapes}{whose}; {work}")
    return ["Models beside full FE, each with sweep and comparison of its own", *lines] if lines else []


def _value_text(key: str, value: object) -> str:
    if value is None:
        return NOT_WRITTEN.get(key, "none")
    if isinstance(value, bool):
        return str(value).lower()
    return f"[{short_list(value)}]" if isinstance(value, tuple) else str(value)


def _torques_text(torques: tuple[float, ...]) -> str:
    count = "1 torque" if len(torques) == 1 else f"{len(torques)} torques"
    return f"{count}: {short_list(torques)} N m"


PARTS: tuple[Callable[[Case], list[str]], ...] = (
    _heading, _settings, _geometry, _blanks, _conditions, _loads, _sizes, _work, _models,
)  # fmt: skip
