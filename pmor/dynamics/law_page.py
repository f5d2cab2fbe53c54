"""The paragraph on the force law of the page of a pair in motion."""

from __future__ import annotations

from collections.abc import Sequence

from pmor.case import Case
from pmor.dynamics.force_law import cycles_of
from pmor.dynamics.law import MeshLaw
from pmor.dynamics.measure import Data


def law_paragraph(case: Case, laws: Sequence[MeshLaw], responses: Sequence[Data]) -> str:
    """Return where the mesh force comes from, how well a table stands for it, and how motion was found."""
    worst = max(laws, key=lambda law: law.error.largest * law.largest_force)
    static = max(law.static_error_um for law in laws)
    share = max(law.static_error_um / law.static_peak_to_peak_um for law in laws)
    sentences = [
        "The mesh force by phase and displacement comes from the line loads of the reduced finite elements; in the "
        "table that stands for it, held against them between its values, it is off by "
        f"{worst.error.largest * worst.largest_force:.2g} N at most and {worst.error.rms * worst.largest_force:.2g} N "
        f"in the mean, of {worst.largest_force:.4g} N at its end; the static transmission error under the torques by "
        f"{1e3 * static:.2g} nm, {share:.1g} of its peak-to-peak value.",
    ]
    cycles = cycles_of(laws[0].table)
    if cycles > 1:
        sentences.append(
            f"Teeth are out of their places: the mesh repeats after {cycles} cycles. Branches are motion that repeats "
            "with the mesh, so there are none: run-up and run-down are by integration over time."
        )
    else:
        whence = "the line loads themselves, solved at each sample" if case.dynamics.law == "exact" else "the table"
        sentences.append(
            f"Branches are by harmonic balance on {whence}, their stability by Floquet multipliers, run-up and "
            "run-down by integration over time on the table."
        )
    return " ".join([*sentences, *_axes(laws, responses)])


def _axes(laws: Sequence[MeshLaw], responses: Sequence[Data]) -> list[str]:
    shares = [share for share in (response["axes_left_out_share"] for response in responses) if share is not None]
    if not shares:
        return []
    axes = laws[-1].assembly.misalignment
    return [
        "Line loads are solved with the axes displaced by the mean mesh force (under the largest torque "
        f"{axes.centre_distance_um:+.3g} µm of centre distance, over the face width {axes.in_plane_um:+.3g} µm in the "
        f"plane of the axes and {axes.out_of_plane_um:+.3g} µm across it); motion about it acts through levers at the "
        "pitch point. At some instants of the largest motion, with the axes displaced as they are then, the mesh "
        f"force differs by {100.0 * max(shares):.2g} % of its mean at most."
    ]
