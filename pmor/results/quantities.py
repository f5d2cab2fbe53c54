"""The table of quantities: whatever results tell, by its key in files, with unit, symbol, words, and what it is of.

Columns of tables, campaigns and designs, and `cases/manual/quantities.md`, follow from it. Those of a mesh name how
they are found from its line contact, alike in pairs, sets and gearboxes: a further row is in the files of all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.results.load_distribution import (
    PRESSURE,
    carrying_face_percent,
    effective_contact_ratio,
    end_pressure_ratio,
    face_load_factor,
    largest_pressure,
    loss_factor,
    tip_edge_load,
    tip_edge_percent,
)
from pmor.results.loads import LineStates

#: of a mesh, by keys: values under each torque, (D,)
Figures = Mapping[str, FloatArray]
PAIR, SET, BOX = "summary.json", "set.json", "gearbox.json"
ALL, TRAINS, MOVING = (PAIR, SET, BOX), (SET, BOX), ("dynamics.json",)
# Units as readers know them.
SHOWN = {"1": "", "1e6": "10⁶", "um": "µm", "N/um": "N/µm", "N/(mm um)": "N/(mm µm)", "kg m2": "kg m²"}


@dataclass(frozen=True)
class Quantity:
    """A quantity.

    Parameters
    ----------
    key : str
        In files, with its unit.
    unit : str
        "1" of a number.
    symbol : str
        Its name, such as at the head of a column.
    words : str
        What it is, beyond its name.
    per : str
        What each value is of: a load, a mesh, a gear, a planet, a bearing.
    files : tuple of str
        Kinds of machines by their files: ``summary.json`` is that of pairs.
    found : callable, optional
        From the geometry of a pair and its line contact to its values under each torque, (D,).
    percent : bool
        Whether readers see a share as a percentage.
    """

    key: str
    unit: str
    symbol: str
    words: str = ""
    per: str = "load"
    files: tuple[str, ...] = ALL
    found: Callable[[GearPair, LineStates], FloatArray] | None = None
    percent: bool = False

    @property
    def shown_unit(self) -> str:
        """Empty where the quantity has none."""
        return "%" if self.percent else SHOWN.get(self.unit, self.unit)

    @property
    def head(self) -> str:
        """Head of a column."""
        return f"{self.symbol} [{self.shown_unit}]" if self.shown_unit else self.symbol


def _of_gears(key: str, unit: str, symbol: str, files: tuple[str, ...] = ()) -> tuple[Quantity, ...]:
    """Quantities of members in keys of their own, as campaigns and torques of pairs have them."""
    pair = dict.fromkeys(("pinion", "wheel"), (PAIR,))
    gears: dict[str, tuple[str, ...]] = pair | dict.fromkeys(("sun", "planet", "ring"), ())
    return tuple(Quantity(key.format(gear), unit, f"{symbol}, {gear}", "", "gear", of) for gear, of in gears.items())


MESHES = {"sun_planet": "sun and planet", "planet_ring": "planet and ring"}
QUANTITIES = (
    Quantity("torque_Nm", "N m", "torque", "amount on the pinion; of sets on the member that the file names"),
    Quantity("first_gear_torque_Nm", "N m", "torque on the first gear", files=(SET,)),
    Quantity("ste_mean_um", "um", "STE mean", "over the mesh cycle; of sets that of the first gear, on held members"),
    Quantity("ste_peak_to_peak_um", "um", "STE p-p", "largest less least over the mesh cycle"),
    Quantity("ste_peak_to_peak_worst_um", "um", "STE p-p at the worst torque", files=()),
    Quantity("ste_harmonics_um", "um", "STE, orders of the mesh", "amplitudes, zero to peak, from the first order on"),
    *(Quantity(f"ste_order_{k}_um", "um", f"STE, order {k} of the mesh", "amplitude, zero to peak", files=(PAIR,))
      for k in range(1, 6)),
    Quantity("ste_um", "um", "STE", "at each angle", files=(SET,)),
    Quantity("ste_of_teeth_um", "um", "of teeth", "part of the mean STE", "mesh", (BOX,)),
    Quantity("ste_of_shafts_um", "um", "of shafts", "part of the mean STE: they bend between bearings", "mesh", (BOX,)),
    Quantity("ste_of_bearings_um", "um", "of bearings", "part of the mean STE, with housing", "mesh", (BOX,)),
    Quantity("unloaded_ste_mean_um", "um", "STE without load, mean", "of rigid flanks", files=(PAIR,)),
    Quantity("unloaded_ste_peak_to_peak_um", "um", "STE without load, p-p", "of rigid flanks", files=(PAIR,)),
    Quantity("first_touch_um", "um", "first touch", "least STE without load", files=(PAIR,)),
    Quantity("ste_mesh_error_percent", "%", "STE, error bar of the mesh", "of the mean", files=ALL),
    Quantity("ste_error_estimate_max_um", "um", "STE, error bar of the reduction", "largest", files=(PAIR,)),
    Quantity("ste_ripple_um", "um", "numerical noise of the curve", "about a smooth one, one pair carrying",
             files=(PAIR,)),
    Quantity("ste_torque_exponent", "1", "exponent of the torque", "with which the deflection grows", files=(PAIR,)),
    Quantity("mesh_order", "1", "order of the mesh", "in `shaft_orders`: orders of the STE over several pitches",
             "order", (PAIR, SET)),
    Quantity("amplitude_um", "um", "amplitude", "of such an order, zero to peak", "order", (PAIR, SET)),
    Quantity("mesh_stiffness_mean_N_per_mm_um", "N/(mm um)", "mesh stiffness", "secant, mean over the mesh cycle",
             "mesh", (PAIR,)),
    Quantity("mesh_stiffness_tangent_mean_N_per_mm_um", "N/(mm um)", "mesh stiffness, tangent",
             "derivative of the force by the STE, mean", "mesh", (PAIR,)),
    Quantity("mesh_force_N", "N", "dynamic mesh force", "of a gearbox in motion, rms of all lines, over its speeds",
             "mesh", ()),
    Quantity("bearing_force_N", "N", "dynamic bearing force", "likewise, of a bearing", "bearing", ()),
    Quantity("radiated_power_mW", "mW", "radiated power", "likewise, equivalent one of the housing", "", ()),
    Quantity("row_force_max_N", "N", "largest row of planet bearings", "of a set in a gearbox, over a turn of its "
             "carrier", "set", ()),
    Quantity("carrier_along_um", "um", "carrier along its axis", "likewise, mean", "set", ()),
    Quantity("k_gamma", "1", "K_γ", "largest mean load of a planet in a mesh cycle over the mean of all", files=TRAINS),
    Quantity("planet_load_over_mean", "1", "load over the mean", "of a planet, of what all take, over a turn of the "
             "carrier: K_γ is the largest", "planet", ()),
    Quantity("carrier_orders", "1", "orders of the carrier", "times in a turn of the carrier against the housing",
             "order", (BOX,)),
    Quantity("contact_ratio", "1", "contact ratio", "transverse, of rigid flanks", "mesh", TRAINS),
    Quantity("overlap_ratio", "1", "overlap ratio", "", "mesh", ()),
    Quantity("phase_pitches", "1", "phase [pitches]", "where in its mesh cycle a mesh is at angle 0", "mesh", TRAINS),
    Quantity("cycles_per_pitch", "1", "mesh cycles", "of a mesh, in a pitch of the first gear", "mesh", TRAINS),
    Quantity("share_mean", "1", "share", "in the load of all that share it, mean over the mesh cycle", "planet, mesh",
             TRAINS, percent=True),
    Quantity("share_max", "1", "largest share", "over the mesh cycle", "planet, mesh", TRAINS, percent=True),
    Quantity("force_N", "N", "force", "in the transverse plane; of bearings along x, y, z", "mesh, bearing", (BOX,)),
    Quantity("force_mean_N", "N", "force", "in the transverse plane, mean", "mesh, bearing", TRAINS),
    Quantity("force_peak_to_peak_N", "N", "force p-p", "of that force over the mesh cycle", "mesh", TRAINS),
    Quantity("pinion_torque_Nm", "N m", "torque on the pinion", "of the mesh, mean", "mesh", TRAINS),
    Quantity("wheel_torque_Nm", "N m", "torque on the wheel", "of the mesh, mean", "mesh", TRAINS),
    Quantity("k_h_beta", "1", "K_Hβ", "largest over mean line load of the face, added up over the mesh cycle", "mesh",
             found=lambda pair, lines: face_load_factor(lines)),
    Quantity("sliced_k_h_beta", "1", "K_Hβ, slices", "of independent slices", "mesh", (BOX,)),
    Quantity("iso_k_h_beta", "1", "K_Hβ, ISO", "ISO 6336-1:2006, method C", "mesh", (BOX,)),
    Quantity("iso_f_beta_um", "um", "F_βx, ISO", "ISO 6336-1:2006, method C", "mesh", (BOX,)),
    Quantity("iso_f_sh_um", "um", "f_sh, ISO", "ISO 6336-1:2006, method C", "mesh", (BOX,)),
    Quantity("effective_contact_ratio", "1", "contact ratio, loaded", "tooth pairs that carry, on average", "mesh",
             found=lambda pair, lines: effective_contact_ratio(lines)),
    Quantity("flank_pressure_max_MPa", "MPa", "largest pressure", PRESSURE, "mesh",
             found=lambda pair, lines: largest_pressure(lines.pressure_MPa, (1, 2, 3))),
    Quantity("line_load_max_N_per_mm", "N/mm", "line load, largest", "over flanks and mesh cycle", "mesh",
             found=lambda pair, lines: lines.load_N_per_mm.max(axis=(1, 2, 3))),
    Quantity("carrying_face_percent", "%", "face that carries", "anywhere in the mesh cycle", "mesh",
             found=lambda pair, lines: carrying_face_percent(lines)),
    Quantity("end_pressure_ratio", "1", "pressure at the ends", "largest within 15 % of the face from its ends, over "
             "the largest between", "mesh", found=lambda pair, lines: end_pressure_ratio(lines)),
    Quantity("tip_edge_load_N_per_mm", "N/mm", "line load at a tip edge", "largest; 0: tips stay clear", "mesh",
             found=lambda pair, lines: tip_edge_load(lines)),
    Quantity("tip_edge_percent", "%", "tip edges carry", "over so much of the mesh cycle", "mesh",
             found=lambda pair, lines: tip_edge_percent(lines)),
    Quantity("loss_factor", "1", "loss factor", "H_VL: sliding of the line loads, mean over the mesh cycle", "mesh",
             found=loss_factor),
    Quantity("friction", "1", "friction", "mean coefficient, `[lubricant]`", "mesh"),
    Quantity("power_W", "W", "power", "that enters, or that a mesh hands on", "load, mesh"),
    Quantity("losses_W", "W", "losses", "load-dependent, of the line loads; without churning", "load, mesh"),
    Quantity("efficiency", "1", "efficiency", "1 less losses over power", "load, mesh"),
    Quantity("fraction", "1", "share", "of a load in the time of a duty cycle", percent=True),
    Quantity("hours", "h", "time", "of a load in a duty cycle"),
    Quantity("pinion_rpm", "rpm", "pinion", "speed, in a load spectrum", "mesh"),
    Quantity("wheel_rpm", "rpm", "wheel", "speed, in a load spectrum", "mesh"),
    Quantity("pinion_cycles", "1", "pinion, turns", "in its hours", "mesh"),
    Quantity("wheel_cycles", "1", "wheel, turns", "in its hours", "mesh"),
    Quantity("f_beta_um", "um", "F_β", "face width times the difference of the slopes of both hubs along the "
             "line of action; positive where flanks overlap more at the larger x", "mesh", (BOX,)),
    Quantity("in_plane_um", "um", "in plane", "of the wheel's axis, over the face width", "mesh", (BOX,)),
    Quantity("out_of_plane_um", "um", "out of plane", "of the wheel's axis, over the face width", "mesh", (BOX,)),
    Quantity("centre_distance_um", "um", "centre distance", "change at mid width", "mesh", (BOX,)),
    Quantity("supports_uneven_percent", "%", "unevenness of supports", "around the axis", "load", (BOX,)),
    Quantity("root_stress_max_MPa", "MPa", "root stress", "largest principal, of both gears", "gear", (PAIR, BOX)),
    *_of_gears("root_stress_{}_MPa", "MPa", "root stress"),
    Quantity("root_stress_range_planet_MPa", "MPa", "range of root stress, planet", "the larger of both sides", "gear",
             ()),
    Quantity("root_stress_range_tension_MPa", "MPa", "range of root stress", "across the root over a load cycle, on "
             "the side of the loaded flank; `compression`: on the other one", "gear", (PAIR,)),
    Quantity("root_stress_iso6336_MPa", "MPa", "root stress, ISO 6336-3:2019", "nominal, with Y_B", "gear", (PAIR,)),
    Quantity("max_principal_MPa", "MPa", "largest principal", "root stress over the mesh cycle", "gear", TRAINS),
    Quantity("range_MPa", "MPa", "range", "of the stress across the root of a tooth, on the side of the largest",
             "gear", TRAINS),
    Quantity("range_other_side_MPa", "MPa", "range on the other side", "", "gear", TRAINS),
    Quantity("pin_force_mean_N", "N", "pin force", "across the pin, mean", "planet", TRAINS),
    Quantity("pin_force_max_N", "N", "largest force on a pin", "over the mesh cycle", "planet", TRAINS),
    Quantity("outwards_um", "um", "outwards", "displacement of a planet, mean", "planet", TRAINS),
    Quantity("around_um", "um", "around", "displacement of a planet in the sense of the sun's torque, mean", "planet",
             TRAINS),
    Quantity("outwards_tilt_mrad", "mrad", "tilt outwards", "slope of the planet's axis", "planet", TRAINS),
    Quantity("around_tilt_mrad", "mrad", "tilt around", "slope of the planet's axis", "planet", TRAINS),
    Quantity("moment_max_Nm", "N m", "moment", "of a planet's bearing, largest", "bearing", TRAINS),
    Quantity("carrier_windup_mrad", "mrad", "wind-up", "of one cheek of the carrier against the other, mean",
             files=TRAINS),
    Quantity("radial_force_N", "N", "radial", "force of the shaft on what a bearing stands on; of each row in `rows`",
             "bearing", TRAINS),
    Quantity("axial_force_N", "N", "axial", "force of the shaft on what a bearing stands on", "bearing", ()),
    Quantity("moment_Nmm", "N mm", "moment", "about y and z", "bearing", (BOX,)),
    Quantity("displacement_um", "um", "displacement", "along x, y, z", "bearing, shaft", (BOX,)),
    Quantity("tilt_mrad", "mrad", "tilt", "about y, z", "bearing, shaft", (BOX,)),
    Quantity("twist_mrad", "mrad", "twist", "along a shaft", "shaft", (BOX,)),
    Quantity("loaded_elements", "1", "loaded elements", "of a rolling bearing", "bearing", TRAINS),
    Quantity("element_force_N", "N", "force", "of each rolling element, row by row", "bearing", TRAINS),
    Quantity("element_azimuth_deg", "deg", "azimuth", "of each rolling element of a row, from y towards z; of planets "
             "from outwards on", "bearing", TRAINS),
    Quantity("contact_pressure_max_MPa", "MPa", "pressure", "of the most loaded element", "bearing", TRAINS),
    Quantity("static_safety", "1", "static safety", "C_0 / P_0, ISO 76:2006", "bearing", TRAINS),
    Quantity("dynamic_rating_N", "N", "C", "basic dynamic load rating, as given or of ISO 281:2007 by inner geometry",
             "bearing", TRAINS),
    Quantity("bearing_rpm", "rpm", "speed", "of one ring against the other", "bearing", TRAINS),
    Quantity("turn_positions", "1", "positions", "of a turn of the carrier, over which damage adds up and loads are "
             "those of the one with the largest; 1: under the mean loads", "bearing", TRAINS),
    Quantity("reference_life_1e6", "1e6", "L_10r", "basic reference rating life, ISO/TS 16281:2008, turns of one ring "
             "against the other", "bearing", TRAINS),
    Quantity("reference_life_h", "h", "L_10rh", "the same in time; in `duty` over all loads (Palmgren and Miner)",
             "bearing", TRAINS),
    Quantity("damage_share", "1", "share of the damage", "of the load of a duty cycle that wears a bearing most",
             "bearing", TRAINS, percent=True),
    Quantity("mesh_frequency_Hz", "Hz", "mesh frequency", "where speeds are given", files=TRAINS),
    Quantity("n_positions_failed", "1", "positions that failed", files=(PAIR,)),
    # Of motion alone.
    Quantity("dte_rms_um", "um", "DTE, rms", "dynamic transmission error over a cycle; of a pair", "load", MOVING),
    Quantity("dte_peak_to_peak_um", "um", "DTE, p-p", "largest less least over a cycle", "load", MOVING),
    Quantity("dynamic_factor", "1", "dynamic factor", "largest over mean force of a mesh", "load, mesh", MOVING),
    Quantity("largest_force_N", "N", "largest mesh force", "over a cycle", "load", MOVING),
    Quantity("smallest_force_N", "N", "smallest mesh force", "over a cycle; below 0 backs touch", "load", MOVING),
    Quantity("separation_um", "um", "flanks part by", "most over a cycle", "load", MOVING),
    Quantity("contact_loss", "1", "without contact", "share of a cycle", "load", MOVING, percent=True),
    Quantity("ste_rms_um", "um", "STE, rms", "about its mean", "load", MOVING),
    Quantity("mesh_force_mean_N", "N", "mesh force, mean", "", "load", MOVING),
    Quantity("mean_force_N", "N", "mesh force, mean", "", "mesh", MOVING),
    Quantity("mesh_stiffness_mean_N_per_um", "N/um", "mesh stiffness, mean", "", "load", MOVING),
    Quantity("mean_tangent_N_per_um", "N/um", "mesh stiffness, mean", "", "mesh", MOVING),
    Quantity("natural_frequency_Hz", "Hz", "natural frequency", "of the gears against each other", "load", MOVING),
    Quantity("natural_speed_rpm", "rpm", "natural speed", "of the pinion: meshes at the natural frequency", "load",
             MOVING),
    Quantity("resonance_Hz", "Hz", "resonance, ISO 6336-1", "method B", "load", MOVING),
    Quantity("resonance_rpm", "rpm", "resonance speed, ISO 6336-1", "method B", "load", MOVING),
    Quantity("force_rms_max_N", "N", "dynamic force, rms", "largest over the speeds", "mesh, bearing", MOVING),
    Quantity("linear_force_rms_max_N", "N", "dynamic force, rms, never parting", "of flanks that stay in contact",
             "mesh, bearing", MOVING),
    Quantity("constant_stiffness_rms_max_N", "N", "dynamic force, rms, constant stiffness", "of the mesh",
             "mesh, bearing", MOVING),
    Quantity("at_rpm", "rpm", "speed of the largest force", "", "bearing", MOVING),
    # Of designs, beside `OF_DESIGNS`.
    Quantity("objective_um", "um", "objective", "mean over the loads by their weights", "", ()),
    # Of campaigns alone.
    *(Quantity(f"line_load_max_{mesh}_N_per_mm", "N/mm", f"line load, {words}", "", "mesh", ())
      for mesh, words in MESHES.items()),
    *(Quantity(f"{key}_{mesh}", "1", f"{symbol}, {words}", "", "mesh", ())
      for key, symbol in (("k_h_beta", "K_Hβ"), ("contact_ratio", "contact ratio")) for mesh, words in MESHES.items()),
    Quantity("speed_ratio", "1", "ratio of speeds", files=()),
    # Of the sun; of the ring alike where planets have one gear: z_sun / count, less its whole part.
    Quantity("mesh_phase_pitches", "pitches", "meshes of the next planet are behind", files=()),
    Quantity("centre_distance_mm", "mm", "centre distance", "", "mesh", ()),
    Quantity("planets_gap_mm", "mm", "gap between neighbouring planets", files=()),
    Quantity("outside_diameter_mm", "mm", "outside diameter of the ring", files=()),
    Quantity("mass_kg", "kg", "mass of all gears", files=()),
    *_of_gears("mass_{}_kg", "kg", "mass"),
    *_of_gears("inertia_{}_kg_m2", "kg m2", "polar inertia"),
    Quantity("best_tip_relief_um", "um", "best tip relief, of both gears", files=()),
    Quantity("best_tip_relief_start_pinion_roll_deg", "deg", "best tip relief, start on the pinion", files=()),
    Quantity("best_tip_relief_start_wheel_roll_deg", "deg", "best tip relief, start on the wheel", files=()),
    Quantity("best_ste_peak_to_peak_um", "um", "STE p-p, best tip relief", files=()),
)  # fmt: skip
#: results of designs by the keys that they have in the table
OF_DESIGNS = {
    "peak_to_peak_um": "ste_peak_to_peak_um", "pressure_MPa": "flank_pressure_max_MPa", "k_h_beta": "k_h_beta",
    "tip_edge_load_N_per_mm": "tip_edge_load_N_per_mm", "root_stress_MPa": "root_stress_max_MPa",
    "k_gamma": "k_gamma", **{f"order_{k}_um": f"ste_order_{k}_um" for k in (1, 2, 3)},
}  # fmt: skip
#: by keys
TABLE = {quantity.key: quantity for quantity in QUANTITIES}
#: keys of those that are read off the line contact of a mesh
OF_MESHES = tuple(quantity.key for quantity in QUANTITIES if quantity.found is not None)


def figures_of_mesh(pair: GearPair, lines: LineStates) -> Figures:
    """Return what is read off the line contact of a mesh under each torque, (D,); NaN where nothing converged."""
    there = lines.converged.any(axis=1)
    return {
        quantity.key: np.where(there, quantity.found(pair, lines), np.nan)
        for quantity in QUANTITIES if quantity.found is not None
    }  # fmt: skip
