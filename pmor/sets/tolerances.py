"""Sets that are drawn within tolerances: each sample is solved as any other set, on the same finite elements.

Percentiles come from solutions, not from derivatives: the mesh load factor is a largest value over planets, has a kink
where two of them are equal, and planets lift off; a sample takes milliseconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.sets.loader import SetFile
from pmor.sets.plan import planetary_errors
from pmor.sets.settings import Eccentricity, SetSections
from pmor.sets.solution import SetSolution, solve_on


@dataclass(frozen=True, eq=False)
class Samples:
    """Sets drawn within tolerances, under D torques.

    Parameters
    ----------
    sections : tuple of SetSections
        Each sample as a set file says it.
    k_gamma, ste_peak_to_peak_um : ndarray, shape (n, D)
        NaN where a position did not converge.
    pitches : int
        Mesh cycles over which each sample is solved.
    """

    sections: tuple[SetSections, ...]
    k_gamma: FloatArray
    ste_peak_to_peak_um: FloatArray
    pitches: int

    @property
    def missing(self) -> FloatArray:
        """Number of samples without a result under each torque, (D,)."""
        return np.asarray(np.isnan(self.ste_peak_to_peak_um).sum(axis=0))


def solve_samples(file: SetFile, solved: SetSolution) -> Samples | None:
    """Solve all sets that the tolerances of a file draw, under the torques of its solution; None without tolerances."""
    if file.sections.tolerances is None:
        return None
    sections = tuple(drawn(file.sections))
    k_gamma, peak_to_peak = np.empty((2, len(sections), len(solved.torque_Nm)))
    for number, said in enumerate(sections):
        displacement, eccentricity = planetary_errors(said, file.plan.bodies, file.plan.clockwise)
        plan = replace(file.plan, displacement=displacement, eccentricity=eccentricity)
        found = solve_on(plan, solved.placed, solved.torque_Nm, file.sample_pitches)
        k_gamma[number], peak_to_peak[number] = found.k_gamma, np.ptp(found.ste_um, axis=1)
    return Samples(sections, k_gamma, peak_to_peak, file.sample_pitches)


def drawn(said: SetSections) -> Iterator[SetSections]:
    """Draw sets within the tolerances of a planetary set; the draws of one error do not depend on the others' sizes."""
    sizes, pins, off = said.tolerances, said.planets, said.eccentricity
    assert sizes is not None
    rng, nothing = np.random.default_rng(sizes.seed), (0.0,) * pins.count
    of_timing = np.random.default_rng([sizes.seed, 1])
    for _ in range(sizes.samples):
        radial, tangential = rng.standard_normal((2, pins.count))
        planets, sun, ring = rng.standard_normal((pins.count, 2)), *rng.standard_normal((2, 2))
        yield replace(
            said,
            planets=replace(
                pins,
                radial_um=tuple((sizes.pins_radial_um * radial + (pins.radial_um or nothing)).tolist()),
                tangential_um=tuple((sizes.pins_tangential_um * tangential + (pins.tangential_um or nothing)).tolist()),
                timing_mrad=_timing(said, of_timing.standard_normal(pins.count)),
            ),
            eccentricity=Eccentricity(
                **_eccentric("sun", off.sun_um, off.sun_deg, sizes.sun_eccentricity_um * sun),
                **_eccentric("ring", off.ring_um, off.ring_deg, sizes.ring_eccentricity_um * ring),
                **_eccentric("planets", off.planets_um or nothing, off.planets_deg or nothing,
                             sizes.planets_eccentricity_um * planets),
            ),
        )  # fmt: skip


def _timing(said: SetSections, drawn: FloatArray) -> tuple[float, ...]:
    """Timing errors of stepped planets with those that are drawn; none where neither is said."""
    size, given = said.tolerances.timing_mrad if said.tolerances else 0.0, said.planets.timing_mrad
    return tuple((size * drawn + (given or 0.0)).tolist()) if size or given else ()


def sample_rows(samples: Samples, torques_Nm: FloatArray) -> list[dict[str, float]]:
    """Return a row for each sample: its errors by the keys of a set file, and its results under each torque."""
    rows = []
    for number, said in enumerate(samples.sections):
        row: dict[str, float] = {"sample": number}
        for section in (said.planets, said.eccentricity):
            for field in fields(section):
                values = getattr(section, field.name)
                if field.name.endswith(("_um", "_mrad", "planets_deg")) and isinstance(values, tuple):
                    row |= {f"{field.name}_{place}": value for place, value in enumerate(values, start=1)}
                elif isinstance(values, float):
                    row[field.name] = values
        for place, torque in enumerate(torques_Nm.tolist()):
            row[f"k_gamma_{torque:g}_Nm"] = float(samples.k_gamma[number, place])
            row[f"ste_peak_to_peak_um_{torque:g}_Nm"] = float(samples.ste_peak_to_peak_um[number, place])
        rows.append(row)
    return rows


def _eccentric(name: str, amount_um: Any, direction_deg: Any, moved: FloatArray) -> dict[str, Any]:
    """Keys of eccentricities that are moved by two components, the one along direction 0 first."""
    found = np.asarray(amount_um) * np.exp(1j * np.radians(direction_deg)) + moved[..., 0] + 1j * moved[..., 1]
    values = {f"{name}_um": np.abs(found), f"{name}_deg": np.degrees(np.angle(found))}
    return {key: tuple(value.tolist()) if value.ndim else float(value) for key, value in values.items()}
