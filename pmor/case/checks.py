"""Rules that tie several values of a case together."""

import math
from typing import Any

from pmor.case.blank import check_blank
from pmor.case.body import check_body
from pmor.case.document import BLANK
from pmor.case.dynamics import check_dynamics
from pmor.case.extrapolation import MISALIGNMENTS
from pmor.case.flanks import check_flanks, untrained_conditions
from pmor.case.gears import GearCase, PairCase
from pmor.case.models import other_models
from pmor.case.rings import check_ring
from pmor.case.schema import Case
from pmor.case.tolerances import OVER_WIDTH, refused_waves
from pmor.case.values import toml_text, wrong_unit_text
from pmor.case.width import meshed_width
from pmor.core.errors import CaseError
from pmor.gear.condition import Misalignment

# A length below this many modules is a slip: a gear so thin, or a hole so small, cannot be meshed sensibly.
SMALLEST_LENGTH = 0.05
# Face over the product of module and teeth above which it is a slip: shafts would twist, not gears mesh.
WIDEST_FACE = 8.0
# Contact points of a flank beyond which a search takes minutes and gigabytes, without any gain.
MOST_CONTACT_POINTS = 1_000_000
# Angles of a sweep beyond which its results fill a computer's memory.
MOST_ANGLES = 1_000_000
# Rim that must stay between bore and root circle, in modules.
THINNEST_RIM = 0.5
# Lifts the rule that sweeps stay within the training.
EXTRAPOLATE = "[online] extrapolate = true and read the error bar"


def check_together(case: Case, document: dict[str, Any], where: str) -> None:
    """Raise `CaseError` where values that are fine alone do not go together.

    Parameters
    ----------
    case : Case
        Complete case.
    document : dict
        The parsed file, to tell written values from defaults.
    where : str
        Name of the file in error messages.
    """
    pair = case.pair
    _check_length(pair.face_width_mm, pair.module_mm, f"{where}: [pair] face_width_mm")
    check_ring(pair, document, where)
    _check_faces(pair, where)
    refuse_uneven_sections(case, where)
    _check_blanks(case, where)
    _check_bore(pair, pair.pinion, f"{where}: [pinion]")
    _check_bore(pair, pair.wheel, f"{where}: [wheel]")
    _check_centre_distance(pair, where)
    _check_sizes(case, where)
    _check_sweep(case, where)
    _check_reduction(case, where)
    _check_torques(case, document, where)
    _check_sampling(case, where)
    _check_misalignment(case, where)
    _check_conditions(case, where)
    _check_tolerances(case, where)
    _check_extrapolation(case, where)
    _check_allowances(pair.pinion, f"{where}: [pinion]")
    _check_allowances(pair.wheel, f"{where}: [wheel]")
    _check_tip_edge(pair.pinion, case.contact.scheme, f"{where}: [pinion]")
    _check_tip_edge(pair.wheel, case.contact.scheme, f"{where}: [wheel]")
    check_flanks(case, where)
    check_dynamics(case.dynamics, where)
    for scheme, model in other_models(case):
        check_together(model, document, f"{where}: [compare] models, {toml_text(scheme)}")


def _check_reduction(case: Case, where: str) -> None:
    reduction, scheme = case.reduction, case.contact.scheme
    if case.pair.wheel.internal and scheme != "line":
        raise CaseError(
            f'{where}: [contact] scheme = "{scheme}": penalty contact takes external gears, and the wheel is a ring: '
            'write scheme = "line"'
        )
    if reduction.shapes == "line_loads" and scheme != "line":
        raise CaseError(
            f'{where}: [reduction] shapes = "line_loads": are the unknowns of line contact, and [contact] scheme = '
            f'"{scheme}" has none: write shapes = "flank_lines", or scheme = "line"'
        )
    if reduction.shapes != "line_loads" and scheme == "line":
        raise CaseError(
            f'{where}: [reduction] shapes = "{reduction.shapes}": line contact has no trained shapes; its line loads '
            'are exact: write shapes = "line_loads", or a penalty scheme such as [contact] scheme = "direct"'
        )


def _check_sizes(case: Case, where: str) -> None:
    mesh, contact = case.mesh, case.contact
    along, across = mesh.profile_elements, mesh.width_elements
    points = (along * contact.lodm_profile + 1) * (across * contact.lodm_width + 1)
    if points > MOST_CONTACT_POINTS:
        raise CaseError(
            f"{where}: [contact] lodm_profile = {contact.lodm_profile}: makes {points} contact points on a flank with "
            f"lodm_width = {contact.lodm_width} on {along} x {across} elements, and {MOST_CONTACT_POINTS} are enough: "
            "lower one of the two"
        )


def _check_sweep(case: Case, where: str) -> None:
    angles = case.pitches * case.online.angles_per_pitch
    if angles > MOST_ANGLES:
        raise CaseError(
            f"{where}: [online] pitches = {toml_text(case.online.pitches or case.pitches)}: makes {angles} angles with "
            f"angles_per_pitch = {case.online.angles_per_pitch}, and {MOST_ANGLES} are enough: lower one of the two"
        )


def _check_length(length_mm: float, module_mm: float, place: str) -> None:
    smallest_mm = SMALLEST_LENGTH * module_mm
    if length_mm < smallest_mm:
        remedy = "raise it"
        if length_mm * 1e3 >= module_mm:
            remedy = wrong_unit_text(length_mm, "metres", "m", length_mm * 1e3, "mm")
        raise CaseError(f"{place} = {length_mm}: must be at least {smallest_mm:g} mm, 0.05 modules: {remedy}")


def _check_faces(pair: PairCase, where: str) -> None:
    faces = []
    for name, gear in (("pinion", pair.pinion), ("wheel", pair.wheel)):
        if gear.face_width_mm is not None:
            _check_length(gear.face_width_mm, pair.module_mm, f"{where}: [{name}] face_width_mm")
        low, high = face = gear.face(pair.face_width_mm)
        faces.append(face)
        widest_mm = WIDEST_FACE * pair.module_mm * gear.teeth
        if high - low > widest_mm:
            key = f"[{name}] face_width_mm" if gear.face_width_mm is not None else "[pair] face_width_mm"
            raise CaseError(
                f"{where}: {key} = {high - low:g}: must be at most {widest_mm:g} mm, {WIDEST_FACE:g} times module and "
                f"teeth of the {name}: lower it"
            )
    common_mm = min(high for _, high in faces) - max(low for low, _ in faces)
    if common_mm < SMALLEST_LENGTH * pair.module_mm:
        spans = " and ".join(f"{low:g} to {high:g}" for low, high in faces)
        raise CaseError(
            f"{where}: [pinion] face_offset_mm = {pair.pinion.face_offset_mm}: the faces of pinion and wheel, {spans} "
            f"mm, share less than {SMALLEST_LENGTH * pair.module_mm:g} mm: bring them together, or widen one"
        )


def refuse_uneven_sections(case: Case, where: str) -> None:
    """Raise CaseError for a helix or faces of their own on a mesh that takes all sections for alike."""
    pair = case.pair
    if pair.helix_angle_deg != 0.0:
        place, what = f"[pair] helix_angle_deg = {pair.helix_angle_deg:g}", "is a helical pair"
    elif pair.pinion.face(pair.face_width_mm) != pair.wheel.face(pair.face_width_mm):
        place, what = "[pinion] and [wheel] face_width_mm, face_offset_mm", "are unequal faces"
    else:
        return
    if case.mesh.width == "plane_strain":
        raise CaseError(
            f'{where}: {place}: {what}, and [mesh] width = "plane_strain" has one section for all of it: write "whole"'
        )


def _check_blanks(case: Case, where: str) -> None:
    """Refuse blanks where the mesh or the contact has no place for them."""
    for name, gear in (("pinion", case.pair.pinion), ("wheel", case.pair.wheel)):
        if gear.one_piece and (case.mesh.width == "plane_strain" or gear.body is not None):
            held = '[mesh] width = "plane_strain"' if gear.body is None else "a body of one's own"
            raise CaseError(f"{where}: [{name}] one_piece = true: {held} is held at its bore: leave one of them out")
        if gear.one_piece and gear.blank is not None and gear.blank.held_length_mm is not None:
            raise CaseError(
                f"{where}: [{name}.{BLANK}] held_length_mm = {gear.blank.held_length_mm:g}: a gear of one piece with "
                "its shaft is held nowhere at its bore: leave it out, or one_piece"
            )
        if gear.rim_gives and case.mesh.width == "plane_strain":
            key = "seat_radial_N_per_mm" if gear.lugs is None else "held"
            raise CaseError(
                f'{where}: [{name}] {key}: [mesh] width = "plane_strain" takes rings that are rigid all over their '
                'outside: write width = "whole", or leave it out'
            )
        if gear.solid(case.pair.face_width_mm):
            continue
        if case.mesh.width == "plane_strain":
            raise CaseError(
                f'{where}: [{name}.{BLANK}]: [mesh] width = "plane_strain" has one section for all of the width, and a '
                'web is narrower: write "whole", or leave the blank out'
            )
        if gear.blank is not None and gear.blank.stress and case.contact.kind != "line":
            raise CaseError(
                f"{where}: [{name}.{BLANK}] stress = true: the stress of webs is found from exact line loads: write "
                '[contact] scheme = "line", or leave it out'
            )
        if gear.repeats(case.pair.face_width_mm) and case.contact.kind != "line":
            raise CaseError(
                f'{where}: [{name}.{BLANK}] holes: [contact] scheme = "{case.contact.scheme}" takes teeth that are all '
                'alike, and holes make them differ: write scheme = "line", or leave the holes out'
            )


def _check_bore(pair: PairCase, gear: GearCase, place: str) -> None:
    module_mm = pair.module_mm
    if gear.bore_radius_mm is None:
        rim_mm = gear.rim_thickness_mm or 0.0
        if rim_mm < THINNEST_RIM * module_mm:
            raise CaseError(
                f"{place} rim_thickness_mm = {rim_mm}: must be at least {THINNEST_RIM * module_mm:g} mm, half a "
                "module: raise it"
            )
        return
    root_mm = module_mm * (gear.teeth / (2.0 * _cos_deg(pair.helix_angle_deg)) + gear.profile_shift - gear.dedendum)
    # Teeth that are cut thinner are cut deeper.
    root_mm += 0.25 * sum(gear.thickness_allowances_mm) / math.tan(math.radians(pair.pressure_angle_deg))
    limit_mm = root_mm - THINNEST_RIM * module_mm
    if limit_mm <= SMALLEST_LENGTH * module_mm:
        raise CaseError(
            f"{place} teeth = {gear.teeth}: the root circle, radius {root_mm:.4g} mm, leaves no room for a bore: "
            "raise teeth or profile_shift, or lower dedendum"
        )
    _check_length(gear.bore_radius_mm, module_mm, f"{place} bore_radius_mm")
    if gear.bore_radius_mm >= limit_mm:
        raise CaseError(
            f"{place} bore_radius_mm = {gear.bore_radius_mm}: must be below {limit_mm:.6g} mm, the root radius "
            f"{root_mm:.6g} mm less half a module of rim: lower it"
        )
    if gear.blank is not None:
        blank = f"{place.removesuffix(']')}.{BLANK}]"
        face_mm = gear.face_width_mm or pair.face_width_mm
        check_blank(gear.blank, root_mm, gear.bore_radius_mm, face_mm, module_mm, blank)
    if gear.body is not None:
        face_mm, blank = gear.face_width_mm or pair.face_width_mm, f"{place.removesuffix(']')}.{BLANK}]"
        check_body(gear.body, root_mm, gear.bore_radius_mm, face_mm, module_mm, gear.youngs_modulus_GPa, blank)


def _check_allowances(gear: GearCase, place: str) -> None:
    if len(gear.tooth_thickness_allowance_um) > 2:
        raise CaseError(
            f"{place} tooth_thickness_allowance_um = {toml_text(gear.tooth_thickness_allowance_um)}: must be one value "
            "or two, the lower and the upper one: leave the others out"
        )


def _check_tip_edge(gear: GearCase, scheme: str, place: str) -> None:
    if gear.tip_rounding_mm > 0.0 and gear.tip_chamfer_mm > 0.0:
        raise CaseError(
            f"{place} tip_rounding_mm = {gear.tip_rounding_mm}: the edge has a chamfer, tip_chamfer_mm = "
            f"{gear.tip_chamfer_mm}: leave one of the two out"
        )
    for key in ("tip_rounding_mm", "tip_chamfer_mm"):
        if getattr(gear, key) > 0.0 and scheme != "line":
            raise CaseError(
                f'{place} {key} = {getattr(gear, key)}: is known to line contact, and [contact] scheme = "{scheme}" '
                'takes the sharp edge of the mesh: write scheme = "line", or leave it out'
            )


def _check_centre_distance(pair: PairCase, where: str) -> None:
    if pair.centre_distance_mm is None:
        return
    distance_mm = pair.centre_distance_mm
    cos_helix = _cos_deg(pair.helix_angle_deg)
    transverse_angle = math.atan(math.tan(math.radians(pair.pressure_angle_deg)) / cos_helix)
    gears, sign = (pair.pinion, pair.wheel), pair.wheel.sign
    reference_mm = abs(pair.module_mm * sum(gear.sign * gear.teeth for gear in gears) / (2.0 * cos_helix))
    base_mm = reference_mm * math.cos(transverse_angle)
    tips_mm = pair.module_mm * sum(gear.addendum + gear.profile_shift for gear in gears)
    tips_mm = reference_mm + sign * (tips_mm - sum(gear.tip_shortening_mm for gear in gears))
    # A ring's pinion leaves its teeth where the axes come together, and contact ends where the base circles touch.
    low_mm, high_mm = (base_mm, tips_mm) if sign > 0 else (max(base_mm, tips_mm), math.inf)
    if low_mm < distance_mm < high_mm:
        return
    remedy = f"the reference distance is {reference_mm:.6g}; leave the key out for the one without backlash"
    if low_mm < distance_mm * 1e3 < min(high_mm, 2.0 * reference_mm):
        remedy = wrong_unit_text(distance_mm, "metres", "m", distance_mm * 1e3, "mm")
    allowed = f"between {low_mm:.6g} (base circles touch) and {high_mm:.6g} (tip circles touch) mm"
    if sign < 0:
        allowed = f"above {low_mm:.6g} mm ({'base' if low_mm == base_mm else 'tip'} circles touch)"
    raise CaseError(f"{where}: [pair] centre_distance_mm = {distance_mm}: must be {allowed}: {remedy}")


def _check_torques(case: Case, document: dict[str, Any], where: str) -> None:
    largest = case.offline.torques_Nm[-1] if case.reduction.trained else math.inf
    if case.torque_Nm > largest:
        raise CaseError(
            f"{where}: [load] torque_Nm = {case.torque_Nm}: is beyond the largest training torque, {largest} N m: "
            "add a larger one to [offline] torques_Nm"
        )
    for section, torques in (("online", case.online.torques_Nm), ("compare", case.compare.torques_Nm)):
        if torques[-1] > largest and not (section == "online" and case.online.extrapolate):
            default = "" if "torques_Nm" in document.get(section, {}) else " (default)"
            remedy = "lower it, or add a larger one to [offline] torques_Nm"
            if section == "online":
                remedy = f"lower it, add a larger one to [offline] torques_Nm, or write {EXTRAPOLATE}"
            raise CaseError(
                f"{where}: [{section}] torques_Nm = {toml_text(torques)}{default}: {torques[-1]} N m is beyond the "
                f"largest training torque, {largest} N m: {remedy}"
            )
    if case.torque_Nm not in case.online.torques_Nm:
        raise CaseError(
            f"{where}: [online] torques_Nm = {toml_text(case.online.torques_Nm)}: the nominal torque is not among "
            f"them: add {case.torque_Nm}, the [load] torque_Nm"
        )


def _check_sampling(case: Case, where: str) -> None:
    offline, reduction = case.offline, case.reduction
    if offline.sampling == "grid" or not reduction.trained:
        return
    if reduction.shapes in ("positions", "pod"):
        raise CaseError(
            f'{where}: [offline] sampling = "{offline.sampling}": shapes = "{reduction.shapes}" are interpolated over '
            'a grid of roll positions: write sampling = "grid", or [reduction] shapes = "flank_lines"'
        )
    if offline.sampling == "greedy" and not reduction.error_estimate:
        raise CaseError(
            f'{where}: [offline] sampling = "greedy": needs the error estimate, and [reduction] error_estimate = '
            "false: write true"
        )


def _check_misalignment(case: Case, where: str) -> None:
    tilts = {"in_plane_um": case.offline.in_plane_um, "out_of_plane_um": case.offline.out_of_plane_um}
    for key, trained in tilts.items():
        if case.mesh.width == "plane_strain" and any(trained):
            raise CaseError(
                f"{where}: [offline] {key} = {toml_text(trained)}: tilted axes load the width unevenly, and [mesh] "
                'width = "plane_strain" has one section for all of it: write "whole", or 0.0 here'
            )
    refuse_uneven_load(case, where)
    for place, values in _misaligned(case):
        for key in MISALIGNMENTS:
            value, trained = getattr(values, key), getattr(case.offline, key)
            within = not case.reduction.trained or trained[0] <= value <= trained[-1]
            if not within and not case.online.extrapolate:
                raise CaseError(
                    f"{where}: {place} {key} = {value}: is beyond the training, {trained[0]:g} to {trained[-1]:g} um: "
                    f"widen [offline] {key}, or write {EXTRAPOLATE}"
                )


def _misaligned(case: Case) -> list[tuple[str, Misalignment]]:
    """Misalignments of a case and of its conditions, each with what messages call its section."""
    listed = [(f"[condition] {toml_text(condition.name)}:", condition.misalignment) for condition in case.conditions]
    return [("[misalignment]", case.misalignment), *listed]


def _check_conditions(case: Case, where: str) -> None:
    for name in untrained_conditions(case):
        if not case.online.extrapolate:
            raise CaseError(
                f"{where}: [condition] {toml_text(name)}: its flanks load the width otherwise than those of the case, "
                f'which train the shapes: write [reduction] shapes = "static_modes", which need no training, or '
                f"{EXTRAPOLATE}"
            )
    largest = case.offline.torques_Nm[-1]
    for condition in case.conditions:
        if case.reduction.trained and abs(condition.torque_Nm) > largest and not case.online.extrapolate:
            raise CaseError(
                f"{where}: [condition] {toml_text(condition.name)}: torque_Nm = {condition.torque_Nm} is beyond the "
                f"largest training torque, {largest} N m: lower it, add a larger one to [offline] torques_Nm, or write "
                f"{EXTRAPOLATE}"
            )


def _check_tolerances(case: Case, where: str) -> None:
    sizes = case.tolerances
    if sizes is None:
        return
    if not sizes.scattering():
        raise CaseError(
            f"{where}: [tolerances]: scatters nothing: write a standard deviation, as helix_slope_um = 5.0, or "
            "flank_tolerance_class = 6"
        )
    if refusal := refused_waves(sizes, case.online.angles_per_pitch):
        raise CaseError(f"{where}: [tolerances] waves_per_pitch: {refusal}")
    if case.mesh.width == "plane_strain" and (over := sizes.scattering(OVER_WIDTH)):
        raise CaseError(
            f'{where}: [tolerances] {over[0]}: varies over the width, of which [mesh] width = "plane_strain" has one '
            'section: write width = "whole", or leave it out'
        )


def refuse_uneven_load(case: Case, where: str) -> None:
    """Raise CaseError for a tilt where the mesh has not the whole width to load unevenly, whatever is extrapolated."""
    width = meshed_width(case)
    if width == "whole":
        return
    for place, values in _misaligned(case):
        for key in ("in_plane_um", "out_of_plane_um"):
            value = getattr(values, key)
            if value == 0.0:
                continue
            half = width == "half"
            held = "half the width, which stands for both halves" if half else "one section for all of the width"
            trained = half and case.reduction.trained
            remedy = f"give [offline] {key} a range with it" if trained else 'write [mesh] width = "whole"'
            raise CaseError(
                f"{where}: {place} {key} = {value}: tilted axes load the width unevenly, and the basis of parallel "
                f"ones has {held}: {remedy}"
            )


def _check_extrapolation(case: Case, where: str) -> None:
    if case.online.extrapolate and case.reduction.trained and not case.reduction.error_estimate:
        raise CaseError(
            f"{where}: [online] extrapolate = true: only the error bar tells the accuracy beyond the training, and "
            "[reduction] error_estimate = false: write true"
        )


def _cos_deg(angle_deg: float) -> float:
    return math.cos(math.radians(angle_deg))
