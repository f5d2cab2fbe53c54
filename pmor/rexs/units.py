"""Units of REXS attributes: those of the standard, and others that programs write."""

from __future__ import annotations

import math

#: units of the standard, of attributes that are read or written; the others have none
UNITS = {
    **dict.fromkeys((
        "addendum_modification", "addendum_reference_profile", "center_distance", "common_face_width",
        "coordinate_where_helix_crowning_is_specified_datum_face",
        "coordinate_where_helix_crowning_is_specified_non_datum_face", "coordinates_of_topographical_modification",
        "custom_pmor_hole_radius", "custom_pmor_joined_at",
        "custom_pmor_holes_on_radius", "custom_pmor_hub_radius", "custom_pmor_hub_width",
        "custom_pmor_thin_rim_bore", "custom_pmor_tip_rounding", "custom_pmor_web_offset", "custom_pmor_web_profile",
        "custom_pmor_web_thickness",
        "diameter_where_profile_crowning_root_is_specified",
        "diameter_where_profile_crowning_tip_is_specified", "diameter_where_profile_slope_amount_is_specified",
        "diameters_of_topographical_modification", "end_relief_depth_datum_face", "end_relief_depth_non_datum_face",
        "end_relief_length_datum_face", "end_relief_length_non_datum_face", "face_width",
        "helix_crowning_amount_datum_face", "helix_crowning_amount_non_datum_face", "helix_evaluation_end",
        "helix_evaluation_start", "helix_highest_point", "helix_slope", "inner_diameter",
        "inner_diameter_begin", "inner_diameter_end", "length",
        "length_where_profile_crowning_root_is_specified", "length_where_profile_crowning_tip_is_specified",
        "load_distribution_node_positions", "normal_module", "outer_diameter_begin", "outer_diameter_end",
        "point_coordinates_radius",
        "point_coordinates_u_coord", "profile_crowning_at_root", "profile_crowning_at_tip", "profile_evaluation_end",
        "profile_evaluation_start", "profile_highest_point", "profile_slope", "profile_twist", "protuberance_amount",
        "root_diameter", "root_relief_datum_diameter", "root_relief_datum_length", "root_relief_depth",
        "root_relief_evaluation_reference", "root_relief_evaluation_reference_length", "support_vector",
        "tip_corner_radius_reference_profile", "tip_diameter", "tip_relief_datum_diameter", "tip_relief_datum_length",
        "tip_relief_depth", "tip_relief_evaluation_reference", "tip_relief_evaluation_reference_length",
        "tooth_tip_chamfer", "tooth_tip_height", "topographical_modification_amounts", "u_axis_vector",
        "diameter_of_rolling_element", "length_of_rolling_element", "raceway_radius_of_inner_ring",
        "outer_diameter", "raceway_radius_of_outer_ring", "width",
        "reference_diameter", "reference_diameter_rolling_bearing", "significant_contact_length_inner_ring",
        "u_coordinate_on_shaft", "u_coordinate_on_shaft_inner_side", "u_coordinates_of_beam_nodes", "w_axis_vector",
    ), "mm"),
    **dict.fromkeys((
        "arithmetic_average_roughness_flank", "arithmetic_mean_roughness_flank_iso_4287_1997",
        "axial_deflection", "custom_pmor_centre_distance", "custom_pmor_f_beta", "custom_pmor_in_plane",
        "custom_pmor_out_of_plane", "custom_pmor_pin_error", "custom_pmor_roughness",
        *(f"custom_pmor_misalignment_{key}" for key in ("in_plane_um", "out_of_plane_um", "centre_distance_um")),
        "custom_pmor_pitch_deviations",
        "custom_pmor_tooth_thickness_allowances", "custom_pmor_transmission_error",
        "custom_pmor_transmission_error_peak_to_peak",
        *(f"displacement_{side}_side_{way}" for side in ("inner", "outer") for way in "uvw"),
        *(f"displacement_{way}_of_nodes" for way in "uvw"),
        "preload_distance", "effective_equivalent_misalignment_iso_6336_2006",
        "misalignment_in_v_direction", "misalignment_in_w_direction",
        "mounted_radial_bearing_clearance", "operating_radial_bearing_clearance", "radial_bearing_clearance",
        "radial_deflection_in_v", "radial_deflection_in_w",
    ), "mum"),
    **dict.fromkeys((
        "angular_misalignment_around_v_axis", "angular_misalignment_around_w_axis",
        "angular_position_around_u", "custom_pmor_first_hole", "custom_pmor_first_planet",
        "custom_pmor_hole_length", "custom_pmor_pinion_angle",
        "helix_angle_reference_diameter", "normal_pressure_angle",
        "point_coordinates_angle_about_u_axis", "pressure_angle", "torsion_u",
        *(f"tilting_{side}_side_{way}" for side in ("inner", "outer") for way in "vw"),
    ), "deg"),
    **dict.fromkeys(("angular_deflection_in_v", "angular_deflection_in_w"), "rad"),
    **dict.fromkeys((
        "load_distribution_along_face_width", "local_normal_line_load", "meshing_stiffness_characteristic",
    ), "N / mm"),
    **dict.fromkeys((
        "custom_pmor_flank_pressure", "custom_pmor_root_stress", "elastic_modulus", "local_hertzian_contact_stress",
        "maximum_hertzian_pressure",
    ), "MPa"),
    **dict.fromkeys((
        "torque", *(f"torque_around_{way}_axis" for way in "uvw"), *(f"torque_acting_on_shaft_{way}" for way in "uvw"),
        *(f"torque_acting_on_{side}_component_{way}" for side in ("inner", "outer") for way in "vw"),
    ), "N m"),
    **dict.fromkeys((
        *(f"force_{way}_direction" for way in "uvw"), *(f"force_acting_on_shaft_{way}" for way in "uvw"),
        *(f"force_acting_on_{side}_component_{way}" for side in ("inner", "outer") for way in "uvw"),
        "nominal_tangential_force_at_base_diameter", "preload_force",
        *(f"operating_point_stiffness_m_{one}_d_{other}" for one in "vw" for other in "uvw"),
    ), "N"),
    **{f"operating_point_stiffness_f_{one}_d_{other}": "N / m" for one in "uvw" for other in "uvw"},
    **{f"operating_point_stiffness_f_{one}_rot_{other}": "N / rad" for one in "uvw" for other in "vw"},
    **{f"operating_point_stiffness_m_{one}_rot_{other}": "N mm / rad" for one in "vw" for other in "vw"},
    "custom_pmor_losses": "W", "power": "kW", "density": "kg / dm^3",
    "density_at_15_degree_celsius": "kg / dm^3", "gravitational_acceleration": "m / s^2",
    "temperature_lubricant": "C", "operating_temperature_lubricant": "C", "custom_pmor_viscosity": "mPa s",
    "viscosity_at_40_degree_celsius": "mm^2 / s", "viscosity_at_100_degree_celsius": "mm^2 / s",
    "operating_time_fraction": "%", "operating_time": "h", "rotational_speed": "1 / min",
    "radial_stiffness": "N / m", "axial_stiffness": "N / m", "bending_stiffness": "N mm / rad",
    "rotational_stiffness": "N mm / rad",
}  # fmt: skip
#: units that are converted, by the one used here; spaces, dots and stars between factors do not count
FACTORS = {
    "mm": {"mm": 1.0, "mum": 1e-3, "um": 1e-3, "\u00b5m": 1e-3, "\u03bcm": 1e-3, "nm": 1e-6, "cm": 10.0, "dm": 100.0,
           "m": 1e3, "in": 25.4, "inch": 25.4},
    "deg": {"deg": 1.0, "\u00b0": 1.0, "degree": 1.0, "rad": 180.0 / math.pi, "mrad": 0.18 / math.pi},
    "MPa": {"MPa": 1.0, "N/mm^2": 1.0, "N/mm\u00b2": 1.0, "Pa": 1e-6, "N/m^2": 1e-6, "kPa": 1e-3, "GPa": 1e3,
            "kN/mm^2": 1e3},
    "N m": {"Nm": 1.0, "Nmm": 1e-3, "Ncm": 1e-2, "kNm": 1e3, "kNmm": 1.0, "MNm": 1e6},
    "N / mm": {"N/mm": 1.0, "N/m": 1e-3, "kN/mm": 1e3},
    "N": {"N": 1.0, "kN": 1e3},
    "N mm / rad": {"Nmm/rad": 1.0, "Nm/rad": 1e3},
    "C": {"C": 1.0, "\u00b0C": 1.0, "degC": 1.0},
    "kg / dm^3": {"kg/dm^3": 1.0, "g/cm^3": 1.0, "kg/m^3": 1e-3},
    "m / s^2": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "mm^2 / s": {"mm^2/s": 1.0, "cSt": 1.0, "m^2/s": 1e6},
    "mPa s": {"mPas": 1.0, "Pas": 1e3},
    "kW": {"kW": 1.0, "W": 1e-3, "MW": 1e3},
    "N / rad": {"N/rad": 1.0, "kN/rad": 1e3},
    "1 / min": {"1/min": 1.0, "rpm": 1.0, "1/s": 60.0, "Hz": 60.0},
    "%": {"%": 1.0},
    "h": {"h": 1.0, "min": 1.0 / 60.0, "s": 1.0 / 3600.0},
    "W": {"W": 1.0, "kW": 1e3, "MW": 1e6},
    "none": {"none": 1.0, "-": 1.0, "1": 1.0},
}  # fmt: skip


def factor_of(attribute: str, unit: str) -> float:
    """Return the factor from a unit to the one used here for an attribute; an empty unit is that of the standard.

    Raises
    ------
    ValueError
        When the unit is unknown, or of another quantity.
    """
    standard = UNITS.get(attribute, "none")
    known = FACTORS.get(standard) or next(factors for factors in FACTORS.values() if _plain(standard) in factors)
    factor = known.get(_plain(unit or standard))
    if factor is None:
        raise ValueError(f"unit = {unit!r}: must be one of {', '.join(known)}")
    return factor


def rounded(value: float) -> float:
    """Round off the last digits, which a change of units leaves and nobody means."""
    return float(f"{value:.12g}")


def _plain(unit: str) -> str:
    return "".join(c for c in unit if not c.isspace() and c not in "*\u00b7\u22c5")
