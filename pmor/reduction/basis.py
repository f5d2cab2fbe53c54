"""The basis: result of the offline stage, input of the online stage; made from snapshots, solutions of full FE."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.body.flank_compliance import FlankCompliance, SolvedGear, flank_compliance
from pmor.body.root_stress import RootStressShapes
from pmor.body.web_stress import WebStress
from pmor.case import Case
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.shown import brief
from pmor.gear.condition import Condition
from pmor.line.layered_pair import LayeredPair, SurfaceLayer, layers_of
from pmor.line.sections import loaded_components
from pmor.pair.model import MeshModel
from pmor.reduction.contact_shapes import ContactShapes
from pmor.reduction.flank_lines import FlankLineShapes


@dataclass(frozen=True)
class Snapshots:
    """Full-FE equilibria at one pinion angle: P tooth pairs that can touch, T conditions, f flank unknowns per tooth.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    conditions : tuple of T Condition
    pair_index : ndarray of int, shape (P,)
    force : ndarray, shape (T, P, 2, f)
        Nodal forces on the flanks of pinion and wheel, N; those on a node and on its image together.
    ste_um : ndarray, shape (T,)
        NaN where not converged.
    converged : ndarray of bool, shape (T,)
    estimate_percent : float
        Largest error estimate before this angle was chosen (`pmor.reduction.basis.Training`); NaN if none was made.
    """

    phi: float
    conditions: tuple[Condition, ...]
    pair_index: IntArray
    force: FloatArray
    ste_um: FloatArray
    converged: BoolArray
    estimate_percent: float = float("nan")

    @property
    def failures(self) -> tuple[str, ...]:
        """Name the solutions that are missing."""
        missing = (c for c, ok in zip(self.conditions, self.converged, strict=True) if not ok)
        return tuple(f"phi = {self.phi:.6g} rad, torque = {1e-3 * c.torque:g} N m" for c in missing)


@brief
@dataclass(frozen=True, eq=False)
class Training:
    """The full-FE solutions that a basis was made from: n angles with T conditions each.

    Parameters
    ----------
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : tuple of n tuples of T Condition
    ste_um : ndarray, shape (T, n)
        Static transmission error of full FE, um; NaN where it did not converge.
    converged : ndarray of bool, shape (T, n)
    estimate_percent : ndarray, shape (n,), or None
        Of a greedy sampling: largest error estimate anywhere, over the STE, before each angle was solved; NaN for those
        that it began with.
    seconds : float
        Wall time of the offline stage.
    """

    phi: FloatArray
    conditions: tuple[tuple[Condition, ...], ...]
    ste_um: FloatArray
    converged: BoolArray
    estimate_percent: FloatArray | None
    seconds: float

    @property
    def torque(self) -> FloatArray:
        """Pinion torques, shape (T, n), N mm."""
        torques = [[condition.torque for condition in there] for there in self.conditions]
        return np.array(torques).reshape(len(torques), -1).T if torques else np.empty((0, 0))


def untrained(seconds: float = 0.0, greedy: bool = False) -> Training:
    """Return the training of a basis that takes none, after so many seconds of the offline stage."""
    nothing = np.empty((0, 0))
    return Training(np.empty(0), (), nothing, nothing.astype(bool), np.empty(0) if greedy else None, seconds)


@brief
@dataclass(frozen=True, eq=False)
class Basis:
    """A reduced basis with all that the online stage needs.

    Parameters
    ----------
    flank_nodes : two ndarrays, shape (n + 1, m + 1, 3)
        Pinion and wheel, mm; as much of the width as is meshed (`pmor.case.width`), like the shapes.
    flank_roll_angle : two ndarrays, shape (n + 1,)
        rad.
    layers : two SurfaceLayer, or none
        Below the flanks of pinion and wheel, as the compliance was without them; of line contact alone.
    shapes : FlankLineShapes, ContactShapes or None
        None for line loads, which stand on the compliance alone.
    compliance : FlankCompliance or None
        For line loads, and for the error estimate; None when the case does not ask for it.
    coarser : Basis or None
        Of the same pair on half as many elements, for the error bar of the mesh; None where there is none.
    root_stress : two RootStressShapes or None
        Of pinion and wheel; the same object for identical gears. None where the case does not ask for it.
    web_stress : two of WebStress or None
        Of pinion and wheel; None where the case does not ask for it.
    whole : Basis or None
        Of the same pair on the whole width, for the live page, where half of it is enough for all else.
    """

    case: Case
    flank_nodes: tuple[FloatArray, FloatArray]
    flank_roll_angle: tuple[FloatArray, FloatArray]
    layers: tuple[SurfaceLayer, ...]
    shapes: FlankLineShapes | ContactShapes | None
    training: Training
    compliance: FlankCompliance | None
    coarser: Basis | None = None
    root_stress: tuple[RootStressShapes, RootStressShapes] | None = None
    web_stress: tuple[WebStress | None, WebStress | None] = (None, None)
    whole: Basis | None = None


def basis_of_gears(
    case: Case, mesh: MeshModel, gears: tuple[SolvedGear, SolvedGear], training: Training,
    shapes: FlankLineShapes | ContactShapes | None = None, coarser: Basis | None = None,
) -> Basis:  # fmt: skip
    """Put the basis of a case together from its solved gears, pinion first, and the shapes trained on them."""
    (pinion, wheel), meshed = gears, mesh.meshed
    components = loaded_components(isinstance(meshed, LayeredPair), meshed.pair.pinion.helix_angle != 0.0)
    # Bodies may be those of another model, with more than this one asks for.
    stress = (pinion.root_stress, wheel.root_stress) if case.root_stress else (None, None)
    webs = (pinion.web_stress, wheel.web_stress) if case.contact.kind == "line" else (None, None)
    return Basis(
        case=case, flank_nodes=(mesh.pinion.flank_nodes, mesh.wheel.flank_nodes),
        flank_roll_angle=(mesh.pinion.flank_roll_angle, mesh.wheel.flank_roll_angle), layers=layers_of(meshed),
        shapes=shapes, training=training, coarser=coarser,
        compliance=flank_compliance(gears, components) if shapes is None or case.reduction.error_estimate else None,
        root_stress=None if stress[0] is None or stress[1] is None else (stress[0], stress[1]),
        web_stress=webs,
    )  # fmt: skip
