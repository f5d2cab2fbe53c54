"""Classical mesh stiffness and transmission error, to print beside the finite-element results.

Three textbook routes, independent of the finite-element code: ISO 6336-1 method B (`iso6336`), the
potential-energy method (`energy_method`) and Weber-Banaschek (`weber_banaschek`). The last two
give the compliance of one tooth pair along the path of contact; here the pairs in mesh are put in parallel.

Both add the gear body's deflection once per pair, whereas in truth neighbouring teeth share one body: in double contact
they are too stiff, and so the finite elements give a larger mean STE and a smaller step between one and two pairs.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pmor.gear.classical import energy_method, iso6336, weber_banaschek
from pmor.gear.classical.tooth_beam import FloatArray, ToothBeam, tooth_beam
from pmor.gear.pair import GearPair

#: compliance of a pair, mm per N/mm, from (position on the path of contact (m,) mm, pair load (m,) N/mm)
PairCompliance = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class GearBody:
    """Bore and material of a gear."""

    bore_radius_mm: float
    youngs_modulus_MPa: float = 210_000.0
    poissons_ratio: float = 0.3

    @property
    def elastic(self) -> tuple[float, float]:
        """Young's modulus and Poisson's ratio."""
        return self.youngs_modulus_MPa, self.poissons_ratio


@dataclass(frozen=True)
class PathOfContact:
    """Transverse path of contact of an external pair, mm. Position 0 is where contact begins (A)."""

    length_mm: float
    base_pitch_mm: float
    base_radius_1_mm: float
    base_radius_2_mm: float
    start_curvature_1_mm: float  # radius of curvature of the pinion's flank at position 0
    interference_length_mm: float  # distance between the two base circles' tangent points, a sin(alpha_w)

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio eps_alpha."""
        return self.length_mm / self.base_pitch_mm

    def curvature_radii(self, position_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Radii of curvature of pinion's and wheel's flank (m,), mm."""
        rho_1 = self.start_curvature_1_mm + position_mm
        return rho_1, self.interference_length_mm - rho_1

    def contact_radii(self, position_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance of the contact point from pinion's and wheel's axis (m,), mm."""
        rho_1, rho_2 = self.curvature_radii(position_mm)
        return np.hypot(self.base_radius_1_mm, rho_1), np.hypot(self.base_radius_2_mm, rho_2)


@dataclass(frozen=True)
class MeshCycle:
    """Quasi-static mesh over one base pitch; arrays (n,)."""

    position_mm: FloatArray
    stiffness_N_per_mm_um: FloatArray  # secant: load per width / STE
    ste_um: FloatArray


@dataclass(frozen=True)
class ClassicalResult:
    """One line of the report's table; None where the method does not say (the note gives the reason)."""

    method: str
    mesh_stiffness_N_per_mm_um: float | None
    ste_mean_um: float | None
    ste_peak_to_peak_um: float | None
    note: str


def path_of_contact(pair: GearPair) -> PathOfContact:
    """Path of contact of a pair in its transverse section."""
    base, (start, end) = pair.pinion.base_radius, pair.pinion_roll_range
    return PathOfContact(
        length_mm=base * (end - start),
        base_pitch_mm=pair.pinion.base_pitch,
        base_radius_1_mm=base,
        base_radius_2_mm=pair.wheel.base_radius,
        start_curvature_1_mm=base * start,
        interference_length_mm=pair.action_length,
    )


def mesh_cycle(
    pair_compliance: PairCompliance,
    path: PathOfContact,
    load_per_width_N_per_mm: float,
    n_positions: int = 200,
    tolerance: float = 1e-10,
) -> MeshCycle:
    """Pairs in mesh in parallel over one base pitch, perfect flanks, total load per face width given.

    The pairs share one approach, so each takes load in proportion to its secant stiffness. With the load-dependent
    Hertz term that is a fixed-point iteration, which contracts fast because the dependence is logarithmic.

    Raises
    ------
    RuntimeError
        When the load shares do not settle.
    """
    if load_per_width_N_per_mm <= 0:
        raise ValueError(f"load per width must be positive, not {load_per_width_N_per_mm:g} N/mm")
    first = path.base_pitch_mm * np.arange(n_positions) / n_positions
    n_pairs = int(np.ceil(path.contact_ratio))
    position = first + path.base_pitch_mm * np.arange(n_pairs)[:, None]
    in_mesh = position <= path.length_mm
    load = np.where(in_mesh, load_per_width_N_per_mm / in_mesh.sum(axis=0), 0.0)
    for _ in range(100):
        stiffness = np.zeros_like(load)
        stiffness[in_mesh] = 1.0 / pair_compliance(position[in_mesh], load[in_mesh])
        new_load = load_per_width_N_per_mm * stiffness / stiffness.sum(axis=0)
        change = np.abs(new_load - load).max()
        load = new_load
        if change <= tolerance * load_per_width_N_per_mm:
            total = stiffness.sum(axis=0)
            return MeshCycle(first, 1e-3 * total, 1e3 * load_per_width_N_per_mm / total)
    raise RuntimeError(f"load sharing between {n_pairs} pairs did not settle: last change {change:.3g} N/mm")


def energy_pair_compliance(
    beams: tuple[ToothBeam, ToothBeam], path: PathOfContact, bodies: tuple[GearBody, GearBody]
) -> PairCompliance:
    """Compliance of one pair by the potential-energy method (independent of load)."""
    contact = energy_method.hertz_compliance(*bodies[0].elastic, *bodies[1].elastic)

    def compliance(position: FloatArray, load: FloatArray) -> FloatArray:
        total = np.full_like(position, contact)
        for beam, radius, body in zip(beams, path.contact_radii(position), bodies, strict=True):
            total = total + energy_method.tooth_compliance(beam, radius, *body.elastic)
            total = total + energy_method.body_compliance(beam, radius, body.youngs_modulus_MPa, body.bore_radius_mm)
        return total

    return compliance


def weber_banaschek_pair_compliance(
    beams: tuple[ToothBeam, ToothBeam], path: PathOfContact, bodies: tuple[GearBody, GearBody]
) -> PairCompliance:
    """Secant compliance of one pair after Weber and Banaschek (Hertz term depends on the pair's load)."""

    def compliance(position: FloatArray, load: FloatArray) -> FloatArray:
        curvatures = path.curvature_radii(position)
        half_width = weber_banaschek.hertz_half_width(load, *curvatures, *bodies[0].elastic, *bodies[1].elastic)
        total = np.zeros_like(position)
        for beam, radius, body in zip(beams, path.contact_radii(position), bodies, strict=True):
            depth = weber_banaschek.depth_to_centre_line(beam, radius)
            total = total + weber_banaschek.tooth_compliance(beam, radius, *body.elastic)
            total = total + weber_banaschek.body_compliance(beam, radius, *body.elastic)
            total = total + weber_banaschek.hertz_compliance(half_width, depth, *body.elastic)
        return total

    return compliance


def classical_results(
    pair: GearPair, bodies: tuple[GearBody, GearBody], torque_Nm: float, blank_factor: float = 1.0
) -> list[ClassicalResult]:
    """Mesh stiffness and quasi-static STE of a gear pair by the three classical routes.

    Parameters
    ----------
    pair : GearPair
        ISO 6336 covers helical ones; the other two methods are for spur gears and then return None with a note.
    bodies : two GearBody
        Of pinion and wheel.
    torque_Nm : float
        At the pinion, positive.
    blank_factor : float
        C_R of ISO 6336-1; the other two know solid bodies alone.

    Returns
    -------
    list of ClassicalResult
        Stiffness is load per face width over mean STE. Where a method does not apply (undercut into the active flank,
        tip radius that does not fit) the row says so instead of giving a number.
    """
    path, load = path_of_contact(pair), 1e3 * torque_Nm / pair.pinion.base_radius / pair.common_width

    def beams() -> tuple[ToothBeam, ToothBeam]:
        if pair.pinion.helix_angle != 0.0:
            raise ValueError("for spur gears only")
        if pair.wheel.internal:
            raise ValueError("for external gears only")
        first, second = (
            tooth_beam(
                t.teeth,
                t.module,
                t.pressure_angle,
                t.generating_profile_shift,
                (t.tip_radius - t.reference_radius) / t.module - t.generating_profile_shift,
                t.dedendum,
                t.rack_tip_radius,
            )  # fmt: skip
            for t in (pair.pinion, pair.wheel)
        )
        return first, second

    def energy() -> tuple[PairCompliance, str]:
        both = beams()
        notes = ["Sainsot-Velex-Duverger body, Yang-Sun contact, plane stress"]
        fits = {energy_method.body_fit_note(both[i], bodies[i].bore_radius_mm) for i in range(2)}
        return energy_pair_compliance(both, path, bodies), "; ".join(notes + sorted(fits - {""}))

    def weber() -> tuple[PairCompliance, str]:
        note = "half-plane body (no bore), load-dependent contact, plane strain"
        return weber_banaschek_pair_compliance(beams(), path, bodies), note

    return [
        _iso_result(pair, load, (bodies[0].youngs_modulus_MPa, bodies[1].youngs_modulus_MPa), blank_factor),
        _cycle_result("potential energy method", energy, path, load),
        _cycle_result("Weber-Banaschek", weber, path, load),
    ]


def iso_stiffness(
    pair: GearPair, load_N_per_mm: float, moduli_MPa: tuple[float, float], blank_factor: float = 1.0
) -> tuple[float, float]:
    """Return c' and c_gamma,alpha of a pair by ISO 6336-1, N/(mm um); warns outside their range.

    Parameters
    ----------
    load_N_per_mm : float
        Transverse force over the face width.
    moduli_MPa : (float, float)
        Of pinion and wheel. The standard corrects for them where they are not those of steel.
    blank_factor : float
        C_R; 1 for solid discs.
    """
    pinion, wheel = pair.pinion, pair.wheel
    helix = pinion.helix_angle
    z_1, z_2 = (
        math.inf if t.internal else iso6336.virtual_tooth_number(t.teeth, helix, t.pressure_angle)
        for t in (pinion, wheel)
    )
    single = iso6336.single_stiffness(
        z_1,
        z_2,
        pinion.profile_shift,
        wheel.profile_shift,
        dedendum=0.5 * (pinion.cut_dedendum + wheel.cut_dedendum),
        pressure_angle_deg=float(np.degrees(pinion.pressure_angle)),
        helix_angle_rad=helix,
        specific_load_N_per_mm=load_N_per_mm * pinion.base_radius / pinion.reference_radius,
        modulus_ratio=_modulus_ratio(moduli_MPa),
        blank_factor=blank_factor,
    )
    return single, iso6336.mesh_stiffness(single, pair.contact_ratio)


def _modulus_ratio(moduli_MPa: tuple[float, float]) -> float:
    if all(195e3 <= modulus <= 216e3 for modulus in moduli_MPa):
        return 1.0
    return 2.0 * moduli_MPa[0] * moduli_MPa[1] / sum(moduli_MPa) / iso6336.STEEL_YOUNGS_MODULUS_MPA


def _iso_result(
    pair: GearPair, load_N_per_mm: float, moduli_MPa: tuple[float, float], blank_factor: float
) -> ClassicalResult:
    """ISO 6336-1 row; its warnings become the row's note, because the report shows them where they matter."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        single, mesh = iso_stiffness(pair, load_N_per_mm, moduli_MPa, blank_factor)
    specific_load = load_N_per_mm * pair.pinion.base_radius / pair.pinion.reference_radius
    ratio = _modulus_ratio(moduli_MPa)
    ratios = f"contact ratio {pair.contact_ratio:.3f}"
    ratios += f", overlap ratio {pair.overlap_ratio:.3f}" if pair.overlap_ratio > 0.0 else ""
    discs = "solid discs" if blank_factor == 1.0 else f"C_R = {blank_factor:.4f}"
    notes = [f"c' = {single:.2f} N/(mm µm), {ratios}, {discs}; gives no curve"]
    notes += ["the ring taken for a rack"] if pair.wheel.internal else []
    notes += ["steel on steel: E as in the standard" if ratio == 1.0 else f"scaled with E/E_steel = {ratio:.3f}"]
    notes += [f"lowered for the specific load of {specific_load:.0f} N/mm"] if specific_load < 100.0 else []
    notes += [str(w.message) for w in caught]
    return ClassicalResult("ISO 6336-1:2006 method B", mesh, load_N_per_mm / mesh, None, "; ".join(notes))


def _cycle_result(
    method: str,
    build: Callable[[], tuple[PairCompliance, str]],
    path: PathOfContact,
    load_N_per_mm: float,
) -> ClassicalResult:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # ranges are named in the note, next to the number
            compliance, note = build()
            cycle = mesh_cycle(compliance, path, load_N_per_mm)
    except ValueError as problem:
        return ClassicalResult(method, None, None, None, f"not applicable: {problem}")
    return ClassicalResult(
        method,
        load_N_per_mm / float(cycle.ste_um.mean()),  # so that load / stiffness gives the mean STE in every row
        float(cycle.ste_um.mean()),
        float(np.ptp(cycle.ste_um)),
        note,
    )
