"""Classical mesh stiffness and transmission error, to print beside the finite-element results.

Three textbook routes, none of which uses the finite-element code: ISO 6336-1 method B (`iso6336`), the
potential-energy method (`energy_method`) and Weber-Banaschek (`weber_banaschek`). The last two
give the compliance of one tooth pair along the path of contact; here the pairs in mesh are put in parallel.

Both add the gear body's deflection once per pair, whereas in truth neighbouring teeth share one body: in double contact
they are too stiff, and so the finite elements give a larger mean STE and a smaller step between one and two pairs.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pmor.gear.classical import energy_method, iso6336, weber_banaschek
from pmor.gear.classical.tooth_beam import FloatArray, ToothBeam, involute_function, tooth_beam

#: compliance of a pair, mm per N/mm, from (position on the path of contact (m,) mm, pair load (m,) N/mm)
PairCompliance = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class PathOfContact:
    """Transverse path of contact of an external pair, mm. Position 0 is where the wheel's tip comes into mesh (A)."""

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


def path_of_contact(
    z_1: int,
    base_radius_1_mm: float,
    base_radius_2_mm: float,
    tip_radius_1_mm: float,
    tip_radius_2_mm: float,
    working_pressure_angle_rad: float,
) -> PathOfContact:
    """Path of contact bounded by the two tip circles."""
    interference = (base_radius_1_mm + base_radius_2_mm) * np.tan(working_pressure_angle_rad)
    rho_tip_1 = np.sqrt(tip_radius_1_mm**2 - base_radius_1_mm**2)
    rho_tip_2 = np.sqrt(tip_radius_2_mm**2 - base_radius_2_mm**2)
    if max(rho_tip_1, rho_tip_2) > interference:
        raise ValueError("a tip circle reaches beyond the other gear's base tangent point: the involutes interfere")
    return PathOfContact(
        length_mm=float(rho_tip_1 + rho_tip_2 - interference),
        base_pitch_mm=2 * np.pi * base_radius_1_mm / z_1,
        base_radius_1_mm=base_radius_1_mm,
        base_radius_2_mm=base_radius_2_mm,
        start_curvature_1_mm=float(interference - rho_tip_2),
        interference_length_mm=float(interference),
    )


def working_pressure_angle(pressure_angle_rad: float, shift_sum: float, tooth_sum: int) -> float:
    """Transverse working pressure angle without backlash: inv a_w = inv a + 2 tan(a) (x_1 + x_2) / (z_1 + z_2).

    Newton's method on the involute function, whose derivative is tan^2.
    """
    target = float(involute_function(pressure_angle_rad)) + 2 * np.tan(pressure_angle_rad) * shift_sum / tooth_sum
    if target <= 0:
        raise ValueError(f"no working pressure angle exists for a profile shift sum of {shift_sum:g}")
    angle = max(pressure_angle_rad, (3.0 * target) ** (1.0 / 3.0))  # inv a is about a^3/3, and convex: Newton descends
    for _ in range(50):
        step = (float(involute_function(angle)) - target) / np.tan(angle) ** 2
        angle -= step
        if abs(step) < 1e-14:
            return float(angle)
    raise ValueError(f"the working pressure angle for a profile shift sum of {shift_sum:g} was not found")


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
    beams: tuple[ToothBeam, ToothBeam],
    path: PathOfContact,
    youngs_modulus_MPa: tuple[float, float],
    poissons_ratio: tuple[float, float],
    bore_radius_mm: tuple[float, float],
) -> PairCompliance:
    """Compliance of one pair by the potential-energy method (independent of load)."""
    (e_1, e_2), (nu_1, nu_2) = youngs_modulus_MPa, poissons_ratio
    contact = energy_method.hertz_compliance(e_1, nu_1, e_2, nu_2)

    def compliance(position: FloatArray, load: FloatArray) -> FloatArray:
        total = np.full_like(position, contact)
        rows = zip(beams, path.contact_radii(position), youngs_modulus_MPa, poissons_ratio, bore_radius_mm, strict=True)
        for beam, radius, e, nu, bore in rows:
            total = total + energy_method.tooth_compliance(beam, radius, e, nu)
            total = total + energy_method.body_compliance(beam, radius, e, bore)
        return total

    return compliance


def weber_banaschek_pair_compliance(
    beams: tuple[ToothBeam, ToothBeam],
    path: PathOfContact,
    youngs_modulus_MPa: tuple[float, float],
    poissons_ratio: tuple[float, float],
) -> PairCompliance:
    """Secant compliance of one pair after Weber and Banaschek (Hertz term depends on the pair's load)."""
    (e_1, e_2), (nu_1, nu_2) = youngs_modulus_MPa, poissons_ratio

    def compliance(position: FloatArray, load: FloatArray) -> FloatArray:
        half_width = weber_banaschek.hertz_half_width(load, *path.curvature_radii(position), e_1, nu_1, e_2, nu_2)
        total = np.zeros_like(position)
        for beam, radius, e, nu in zip(
            beams, path.contact_radii(position), youngs_modulus_MPa, poissons_ratio, strict=True
        ):
            depth = weber_banaschek.depth_to_centre_line(beam, radius)
            total = total + weber_banaschek.tooth_compliance(beam, radius, e, nu)
            total = total + weber_banaschek.body_compliance(beam, radius, e, nu)
            total = total + weber_banaschek.hertz_compliance(half_width, depth, e, nu)
        return total

    return compliance


def classical_results(
    *,
    teeth: tuple[int, int],
    module_mm: float,
    pressure_angle_rad: float,
    face_width_mm: float,
    bore_radius_mm: tuple[float, float],
    torque_Nm: float,
    youngs_modulus_MPa: tuple[float, float] = (210_000.0, 210_000.0),
    poissons_ratio: tuple[float, float] = (0.3, 0.3),
    profile_shift: tuple[float, float] = (0.0, 0.0),
    addendum: tuple[float, float] = (1.0, 1.0),
    dedendum: tuple[float, float] = (1.25, 1.25),
    rack_tip_radius: tuple[float, float] = (0.38, 0.38),
    helix_angle_rad: float = 0.0,
    centre_distance_mm: float | None = None,
) -> list[ClassicalResult]:
    """Mesh stiffness and quasi-static STE of a gear pair by the three classical routes.

    Parameters
    ----------
    teeth, bore_radius_mm, youngs_modulus_MPa, poissons_ratio, profile_shift, addendum, dedendum, rack_tip_radius
        Pinion's value first. Shift, addendum, dedendum and rack tip radius in (normal) modules.
    torque_Nm : float
        At the pinion.
    helix_angle_rad : float
        ISO 6336 covers helical gears; the other two methods are for spur gears and then return None with a note.
    centre_distance_mm : float, optional
        Default: the centre distance without backlash.

    Returns
    -------
    list of ClassicalResult
        Stiffness is load per face width over mean STE. Where a method does not apply (undercut into the active flank,
        tip radius that does not fit) the row says so instead of giving a number.
    """
    rack = _Rack(teeth, module_mm, pressure_angle_rad, helix_angle_rad, profile_shift, addendum, dedendum)
    try:
        path = _path(rack, centre_distance_mm)
        load = 1e3 * torque_Nm / path.base_radius_1_mm / face_width_mm
        if load <= 0:
            raise ValueError(f"no load: pinion torque {torque_Nm:g} N m")
    except ValueError as problem:
        names = ("ISO 6336-1 method B", "potential energy method", "Weber-Banaschek")
        return [ClassicalResult(name, None, None, None, f"not applicable: {problem}") for name in names]
    rows = [_iso_result(rack, path, face_width_mm, torque_Nm, load, youngs_modulus_MPa)]

    def beams() -> tuple[ToothBeam, ToothBeam]:
        if helix_angle_rad != 0.0:
            raise ValueError("for spur gears only")
        first, second = (
            tooth_beam(
                teeth[i], module_mm, pressure_angle_rad, profile_shift[i], addendum[i], dedendum[i], rack_tip_radius[i]
            )
            for i in range(2)
        )
        return first, second

    def energy() -> tuple[PairCompliance, str]:
        pair = beams()
        notes = ["Sainsot-Velex-Duverger body, Yang-Sun contact, plane stress"]
        notes += sorted({energy_method.body_fit_note(pair[i], bore_radius_mm[i]) for i in range(2)} - {""})
        return energy_pair_compliance(pair, path, youngs_modulus_MPa, poissons_ratio, bore_radius_mm), "; ".join(notes)

    def weber() -> tuple[PairCompliance, str]:
        note = "half-plane body (no bore), load-dependent contact, plane strain"
        return weber_banaschek_pair_compliance(beams(), path, youngs_modulus_MPa, poissons_ratio), note

    rows.append(_cycle_result("potential energy method", energy, path, load))
    rows.append(_cycle_result("Weber-Banaschek", weber, path, load))
    return rows


@dataclass(frozen=True)
class _Rack:
    """Basic geometry of the two gears; pinion first, lengths in normal modules."""

    teeth: tuple[int, int]
    module_n_mm: float
    pressure_angle_n_rad: float
    helix_angle_rad: float
    profile_shift: tuple[float, float]
    addendum: tuple[float, float]
    dedendum: tuple[float, float]


def _path(rack: _Rack, centre_distance_mm: float | None) -> PathOfContact:
    """Path of contact in the transverse section."""
    cos_beta = np.cos(rack.helix_angle_rad)
    alpha_t = float(np.arctan(np.tan(rack.pressure_angle_n_rad) / cos_beta))
    pitch = [0.5 * z * rack.module_n_mm / cos_beta for z in rack.teeth]
    base = [float(r * np.cos(alpha_t)) for r in pitch]
    tip = [
        float(r + rack.module_n_mm * (h + x)) for r, h, x in zip(pitch, rack.addendum, rack.profile_shift, strict=True)
    ]
    if centre_distance_mm is None:
        # Shift coefficients in transverse modules: x_n m_n = x_t m_t
        alpha_w = working_pressure_angle(alpha_t, sum(rack.profile_shift) * cos_beta, sum(rack.teeth))
    elif centre_distance_mm <= sum(base):
        raise ValueError(f"centre distance {centre_distance_mm:g} mm is below the sum of the base radii")
    else:
        alpha_w = float(np.arccos(sum(base) / centre_distance_mm))
    return path_of_contact(rack.teeth[0], base[0], base[1], tip[0], tip[1], alpha_w)


def _iso_result(
    rack: _Rack,
    path: PathOfContact,
    face_width_mm: float,
    torque_Nm: float,
    load_N_per_mm: float,
    youngs_modulus_MPa: tuple[float, float],
) -> ClassicalResult:
    """ISO 6336-1 row; its warnings become the row's note, because the report shows them where they matter."""
    e_1, e_2 = youngs_modulus_MPa
    ratio = 2.0 * e_1 * e_2 / (e_1 + e_2) / iso6336.STEEL_YOUNGS_MODULUS_MPA
    # The standard corrects for the modulus only when the pair is not steel on steel.
    ratio = 1.0 if all(195e3 <= e <= 216e3 for e in youngs_modulus_MPa) else ratio
    pitch_radius = 0.5 * rack.teeth[0] * rack.module_n_mm / np.cos(rack.helix_angle_rad)
    specific_load = 1e3 * torque_Nm / pitch_radius / face_width_mm
    z_n = [iso6336.virtual_tooth_number(z, rack.helix_angle_rad, rack.pressure_angle_n_rad) for z in rack.teeth]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        single = iso6336.single_stiffness(
            z_n[0],
            z_n[1],
            rack.profile_shift[0],
            rack.profile_shift[1],
            dedendum=0.5 * sum(rack.dedendum),
            pressure_angle_deg=float(np.degrees(rack.pressure_angle_n_rad)),
            helix_angle_rad=rack.helix_angle_rad,
            specific_load_N_per_mm=specific_load,
            modulus_ratio=ratio,
        )
        mesh = iso6336.mesh_stiffness(single, path.contact_ratio)
    overlap = face_width_mm * np.sin(abs(rack.helix_angle_rad)) / (np.pi * rack.module_n_mm)
    ratios = f"contact ratio {path.contact_ratio:.3f}" + (f", overlap ratio {overlap:.3f}" if overlap > 0.0 else "")
    notes = [f"c' = {single:.2f} N/(mm µm), {ratios}, solid discs; gives no curve"]
    notes += ["steel on steel: E as in the standard" if ratio == 1.0 else f"scaled with E/E_steel = {ratio:.3f}"]
    notes += [f"lowered for the specific load of {specific_load:.0f} N/mm"] if specific_load < 100.0 else []
    notes += [str(w.message) for w in caught]
    return ClassicalResult("ISO 6336-1 method B", mesh, load_N_per_mm / mesh, None, "; ".join(notes))


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
