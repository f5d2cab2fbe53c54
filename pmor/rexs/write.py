"""A case and its results as a REXS 2.0 file: two shafts with a gear each, one stage, results under its torque.

For the transmission error REXS has no attribute: it stands under names of our own, as the standard provides.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pmor.case import Case, GearCase
from pmor.case.coast import as_drawn
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.gear.profile import profiles
from pmor.gear.tooth import Tooth
from pmor.rexs.blanks import blank_attributes
from pmor.rexs.document import Attributes, Document, Value
from pmor.rexs.gears import LEAST_RIM
from pmor.rexs.joints import RING
from pmor.rexs.parts import add_shaft
from pmor.rexs.results import StageResults
from pmor.rexs.rings import CUTTER, cutter_attributes, ring_attributes
from pmor.rexs.stage import CARRYING, OFF_PLACE
from pmor.rexs.units import rounded

MM = 1e-3  # per um


def rexs_text(case: Case, pair: GearPair, results: StageResults | None, date: str) -> bytes:
    """Return the text of the file of a case, its pair and its results; `date` is ISO 8601."""
    document = Document()
    unit = document.add("gear_unit", case.title, model_name=case.name)
    loaded, sense, drawn = "left", 1.0, as_drawn(case)
    if case.flank == "coast":
        loaded, sense = "right", -1.0
    stage = document.add_to(
        unit, "cylindrical_stage", f"Stage of {case.name}", **stage_attributes(pair), **case_attributes(case)
    )
    start = min(low for low, _ in pair.faces)
    gears, data, flanks = list[int](), list[int](), list[int]()
    for number, name in enumerate(("pinion", "wheel")):
        speed: Attributes = {} if number or case.speed_rpm is None else {"rotational_speed": sense * case.speed_rpm}
        # What is read again has z = 0 in the middle of the common face.
        place = start - 0.5 * sum(pair.common_face), 0.0, number * pair.centre_distance
        shaft = add_shaft(document, unit, f"Shaft of the {name}", place, **speed)
        gear, sides = add_gear(document, drawn, pair, number, name, pair.faces[number][0] - start)
        document.relate("assembly", assembly=shaft, part=gear)
        gears.append(gear)
        flanks.append(sides[loaded])
        data.append(document.add("cylindrical_stage_gear_data", "", is_driving_gear=number == 0))
        document.relate("stage_gear_data", stage=stage, gear=gear, stage_gear_data=data[-1])
    document.relate("stage", stage=stage, gear_1=gears[0], gear_2=gears[1])
    ratio = pair.wheel.teeth / pair.pinion.teeth
    for nominal in torques_of(case):
        document.cases.append({
            data[number]: {"torque": rounded(sense * torque), "loaded_tooth_flank": loaded}
            for number, torque in enumerate((nominal, -nominal * ratio))
        })  # fmt: skip
    loads = document.cases[0]
    if results is not None:
        loads[stage] = _found(results)
        loads |= _points(document, pair, flanks[0], results, sense)
    return document.text(date)


def torques_of(case: Case) -> tuple[float, ...]:
    """Return the torques of the load cases, N m: the nominal one, and those of the sweep below it, ascending."""
    return case.torque_Nm, *sorted({torque for torque in case.online.torques_Nm if torque < case.torque_Nm})


def not_written(case: Case) -> str:
    """Return in one line which settings of a case its file does not hold; empty where it holds all."""
    lost = ["[[condition]]"] if case.conditions else []
    lost += ["torques above the nominal one"] if max(case.online.torques_Nm, default=0.0) > case.torque_Nm else []
    lost += ["[mesh], [contact], [reduction] and the training, which are those of a new case when it is read"]
    return f"not in the REXS file: {', '.join(lost)}"


def case_attributes(case: Case) -> dict[str, Value]:
    """Return what a stage has under names of ours: by how much its wheel is off its place, and carrying flanks."""
    off: dict[str, Value] = {
        f"{OFF_PLACE}{key}": value for key, value in vars(as_drawn(case).misalignment).items() if value
    }
    return off | ({} if case.flank == "drive" else {CARRYING: case.flank})


def stage_attributes(pair: GearPair) -> dict[str, Value]:
    """Return the geometry of a stage."""
    return {
        "center_distance": abs(pair.centre_distance), "common_face_width": rounded(pair.common_width),
        "gear_ratio": pair.wheel.teeth / pair.pinion.teeth, "radial_contact_ratio": pair.contact_ratio,
        "overlap_contact_ratio": pair.overlap_ratio, "total_contact_ratio": pair.total_contact_ratio,
    }  # fmt: skip


def add_gear(
    document: Document, case: Case, pair: GearPair, number: int, name: str, place: float, datum: str = "positive",
    image: bool = False, back: tuple[Modification, GearPair] | None = None, /, **more: Value,
) -> tuple[int, dict[str, int]]:  # fmt: skip
    """Add a gear with flanks, tool, material and modifications; return its id and those of its left and right flank.

    Parameters
    ----------
    case : Case
        As it is drawn.
    number : int
        0 pinion, 1 wheel.
    place : float
        Where its face begins on its shaft, mm.
    datum : {"positive", "negative"}
        Where z of the case looks along the shaft.
    image : bool
        Whether the gear is the image, x to -x, of that of the case: of the other hand, loaded on the right flank.
    back : (Modification, GearPair), optional
        Of the flank that is not loaded, and the pair in which it is the pinion's; without, as the case has it.
    **more : str, float or sequence
        Further attributes of the gear.
    """
    said: GearCase = (case.pair.pinion, case.pair.wheel)[number]
    tooth, (low, high) = (pair.pinion, pair.wheel)[number], pair.faces[number]
    inner = {} if said.bore_radius_mm is None else {"inner_diameter": rounded(2.0 * said.bore_radius_mm)}
    if said.bore_radius_mm is not None and tooth.root_radius - said.bore_radius_mm < LEAST_RIM * case.pair.module_mm:
        inner["custom_pmor_thin_rim_bore"] = inner["inner_diameter"]
    gear = document.add(
        RING if said.internal else "cylindrical_gear", name, number_of_teeth=said.teeth,
        normal_module=case.pair.module_mm,
        helix_angle_reference_diameter=(-1 if number else 1) * (-1 if image else 1) * case.pair.helix_angle_deg,
        face_width=rounded(high - low), u_coordinate_on_shaft=rounded(place + 0.5 * (high - low)),
        datum_face_orientation=datum,
        tip_diameter=2.0 * abs(tooth.tip_radius), **(ring_attributes(said, tooth) if said.internal else inner),
        **blank_attributes(said.blank), **more,
    )  # fmt: skip
    document.refer(
        gear, "material", f"Material of the {name}", elastic_modulus=rounded(1e3 * said.youngs_modulus_GPa),
        poisson_ratio=said.poisson_ratio, density=rounded(1e-3 * case.dynamics.density_kg_m3),
    )  # fmt: skip
    cuts: dict[str, Value] = {
        "addendum_coefficient_reference_profile": said.dedendum,
        "tip_corner_radius_factor_reference_profile": said.rack_tip_radius,
    }
    kind, cuts = (CUTTER, cutter_attributes(said, tooth)) if said.internal else ("rack_shaped_tool", cuts)
    tool = document.add(kind, f"Tool of the {name}", **cuts)
    settings = document.add("cylindrical_gear_manufacturing_settings")
    own = (case.pinion_modification, case.wheel_modification)[number]
    sides = "left", "right"
    loaded, other = sides[::-1] if image else sides
    modified = {loaded: profiles(pair)[number].in_roll_angles(own)}
    if back is None:
        modified[other] = profiles(pair)[number].in_roll_angles(case.other_flanks[number])
    else:
        modified[other] = profiles(back[1])[0].in_roll_angles(back[0])
    flanks = {}
    for side in sides:
        keys: dict[str, Value] = {
            "normal_pressure_angle": case.pair.pressure_angle_deg,
            "addendum_modification_coefficient": said.profile_shift, "tooth_tip_chamfer": said.tip_chamfer_mm,
        }  # fmt: skip
        if said.tip_rounding_mm:
            keys["custom_pmor_tip_rounding"] = said.tip_rounding_mm
        if said.tooth_thickness_allowance_um:
            keys["custom_pmor_tooth_thickness_allowances"] = said.tooth_thickness_allowance_um
        modification = modified[side]
        if modification.pitch_deviations_um:
            keys["custom_pmor_pitch_deviations"] = modification.pitch_deviations_um
        flanks[side] = document.add("cylindrical_gear_flank", f"{side} flank of the {name}", **keys)
        document.relate("manufacturing_step", workpiece=flanks[side], tool=tool, manufacturing_settings=settings)
        for kind, attributes in _modifications(modification, tooth):
            document.refer(flanks[side], kind, **attributes)
    document.relate("flank", gear=gear, **flanks)
    return gear, flanks


def _modifications(one: Modification, tooth: Tooth) -> list[tuple[str, Mapping[str, Value]]]:
    """List the modifications as components; the datum face has the larger z."""
    found: list[tuple[str, Mapping[str, Value]]] = []

    def diameter(roll_deg: float | None) -> float:
        return 2.0 * abs(tooth.base_radius) * math.hypot(1.0, math.radians(roll_deg or 0.0))

    for which, amount, roll, shape in (
        ("tip", one.tip_relief_um, one.tip_relief_start_roll_deg, one.tip_relief_shape),
        ("root", one.root_relief_um, one.root_relief_end_roll_deg, one.root_relief_shape),
    ):
        if amount:
            found.append((f"{which}_relief", {
                f"{which}_relief_depth": _mm(amount), f"{which}_relief_datum_diameter": diameter(roll),
                "shape_of_relief": shape,
            }))  # fmt: skip
    helix_crowning = "helix_crowning_amount_datum_face", "helix_crowning_amount_non_datum_face"
    found += [
        (kind, dict.fromkeys(attributes, _mm(amount)))
        for kind, amount, attributes in (
            ("profile_crowning", one.profile_crowning_um, ("profile_crowning_at_root", "profile_crowning_at_tip")),
            ("profile_slope", one.profile_slope_um, ("profile_slope",)),
            ("helix_crowning", one.helix_crowning_um, helix_crowning),
            ("helix_slope", -one.helix_slope_um, ("helix_slope",)),
            ("profile_twist", -one.twist_um, ("profile_twist",)),
        )
        if amount
    ]
    if one.end_relief_um:
        for face in ("datum_face", "non_datum_face"):
            found.append((f"end_relief_{face}", {
                f"end_relief_depth_{face}": _mm(one.end_relief_um),
                f"end_relief_length_{face}": one.end_relief_length_mm or 0.0, "shape_of_relief": "linear",
            }))  # fmt: skip
    if (grid := one.topography) is not None:
        found.append(("topographical_modification", {
            "diameters_of_topographical_modification": [diameter(roll) for roll in grid.roll_deg],
            "coordinates_of_topographical_modification": [-z + 0.0 for z in grid.z_mm],
            "topographical_modification_amounts": [_mm(a) for row in grid.amount_um for a in row],
            "type_of_interpolation_topographical_modification": "spline",
        }))  # fmt: skip
    return found


def _found(results: StageResults) -> dict[str, Value]:
    return {
        "meshing_stiffness_characteristic": results.stiffness_N_per_mm,
        "face_load_factor_contact_stress": results.face_load_factor, "load_distribution_node_positions": results.z_mm,
        "load_distribution_along_face_width": results.load_N_per_mm,
        "custom_pmor_pinion_angle": np.degrees(results.phi_rad), "custom_pmor_transmission_error": results.ste_um,
        "custom_pmor_transmission_error_peak_to_peak": float(np.ptp(results.ste_um))
    }  # fmt: skip


def _points(
    document: Document, pair: GearPair, flank: int, results: StageResults, sense: float
) -> dict[int, Attributes]:
    """Add the points of the pinion's flank that carry over the cycle, and return their load and pressure."""
    roll = results.roll_rad[:, 0]
    ids = np.arange(1, len(roll) + 1)
    points = document.add_to(
        flank, "point_list", "Contact points of the pinion over the mesh cycle",
        kind_of_point_list="meshing_contact_points", point_ids=ids,
        point_coordinates_u_coord=results.point_z_mm - pair.faces[0][0],
        point_coordinates_radius=pair.pinion.base_radius * np.hypot(1.0, roll),
        point_coordinates_angle_about_u_axis=np.degrees(sense * _angle(pair, roll, results.point_z_mm)),
    )  # fmt: skip
    data = document.refer(points, "meshing_contact_stage_data_set")
    return {data: {
        "set_ids": ids, "local_normal_line_load": results.point_load_N_per_mm,
        "local_hertzian_contact_stress": results.pressure_MPa,
    }}  # fmt: skip


def _angle(pair: GearPair, roll: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Angle of flank points about the pinion's axis, from the middle of the tooth at mid width, rad."""
    tooth = pair.pinion
    return tooth.base_half_angle - (roll - np.arctan(roll)) + tooth.twist_per_length * z


def _mm(amount_um: float) -> float:
    return rounded(MM * amount_um)
