"""The page on thin slices: the effect of the coupling of teeth and sections on motion."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.case import Case, text_of
from pmor.dynamics.measure import Data
from pmor.lab.slices.run import run_slices
from pmor.report.chart import COLOURS
from pmor.report.page import Block, Picture
from pmor.report.style import panels
from pmor.report.table import Columns, table
from pmor.storage.results_folder import refuse_in_the_way
from pmor.work.results import Report, writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: files of the experiment
FILES = "slices.json", "slices.md", "report.html", "slices.png"
# Kinds of law, and how their lines look.
KINDS = {"coupled": ("coupled", "-"), "slices": ("thin slices", "--")}
COLUMNS: Columns = {
    "torque, N m": "torque_Nm",
    "law": "law",
    "natural frequency, Hz": "natural_frequency_Hz",
    "mean stiffness, N/µm": "mesh_stiffness_mean_N_per_um",
    "swing of it, %": lambda row: _percent_of_mean(row, _range_of(row)),
    "its rms, %": lambda row: _percent_of_mean(row, float(np.std(row["mesh_stiffness_N_per_um"]))),
    "damping, %": lambda row: 100.0 * row["damping_ratio"],
    "jump up at": lambda row: _fold(row, "run_up"),
    "jump down at": lambda row: _fold(row, "run_down"),
    "largest DTE rms, µm": lambda row: max((p["dte_rms_um"] for p in row["branch"] if p["stable"]), default=None),
}
WORDS = (
    "The same pair without coupling between teeth and between sections, as thin slices have none. An even load on a "
    "single pair of teeth bends it as before; with two pairs neither sinks under the load of the other, and the mesh "
    "is stiffer there."
)
CAPTION = (
    "Tangent stiffness at rest over the mesh cycle, and the stable response at the highest damping over the natural "
    "frequency of each: coupled (solid), thin slices (dashed)."
)
NOTE = "Jump frequencies of the main resonance, over the natural frequency of each law; empty: no jump."


@dataclass(frozen=True, eq=False)
class Slices:
    """A case in motion with the coupling and without, under each torque (`pmor.lab.slices.run.run_slices`)."""

    case: Case
    torques: Sequence[Data]

    @property
    def failures(self) -> tuple[str, ...]:
        """Responses that ended early, in words."""
        responses = (damped for torque in self.torques for kind in KINDS for damped in torque[kind]["responses"])
        return tuple(text for damped in responses for text in damped["lost"])

    def __str__(self) -> str:
        return f"{len(self.torques)} torques, coupled and in slices"

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `slices.json`, `slices.md`, `report.html` and the picture."""
        rows = [
            {"torque_Nm": torque["torque_Nm"], "law": name, **torque[kind], **damped}
            for torque in self.torques for kind, (name, _) in KINDS.items() for damped in torque[kind]["responses"]
        ]  # fmt: skip
        blocks: list[Block] = [WORDS, Picture("slices.png", CAPTION, _figure(self.torques)),
                  table("Coupled and in slices", COLUMNS, rows, NOTE)]  # fmt: skip
        data = {"case": self.case.name, "thin_slices": list(self.torques)}
        with writing_results(Path(folder), FILES, text_of(self.case), overwrite=overwrite) as out:
            Report("slices", data, f"Thin slices in motion: {self.case.title}", blocks, self.case).write(out)


def run(
    case: Case, *, folder: Path | str | None = None, overwrite: bool = False, executor: Executor | None = None
) -> Slices:
    """Compare a case with its thin slices, as `pmor lab slices`; `executor` shares out the force laws."""
    if folder is not None:
        refuse_in_the_way([Path(folder) / name for name in FILES], overwrite)
    return Slices(case, run_slices(case, executor=executor))


def _range_of(row: Data) -> float:
    return float(row["mesh_stiffness_max_N_per_um"] - row["mesh_stiffness_min_N_per_um"])


def _percent_of_mean(row: Data, stiffness: float) -> float:
    return 100.0 * stiffness / float(row["mesh_stiffness_mean_N_per_um"])


def _fold(row: Data, kind: str) -> float | None:
    """Highest frequency at which motion jumps, over the natural one: superharmonics jump below."""
    frequencies = [fold["mesh_frequency_Hz"] for fold in row["folds"] if fold["kind"] == kind]
    return max(frequencies) / row["natural_frequency_Hz"] if frequencies else None


def _figure(slices: Sequence[Data]) -> Figure:
    with panels(2, 9.2, 4.4, legend=4) as (figure, (left, right)):
        for place, of_torque in enumerate(slices):
            for kind, (name, dashes) in KINDS.items():
                law = of_torque[kind]
                line: dict[str, Any] = {"color": COLOURS[place % len(COLOURS)], "lw": 1.2, "ls": dashes}
                stiffness = law["mesh_stiffness_N_per_um"]
                cycle = np.arange(len(stiffness)) / len(stiffness)
                left.plot(cycle, stiffness, label=f"{of_torque['torque_Nm']:g} N m, {name}", **line)
                branch = max(law["responses"], key=lambda damped: float(damped["damping_ratio"]))["branch"]
                speeds = np.array([point["mesh_frequency_Hz"] for point in branch]) / law["natural_frequency_Hz"]
                right.plot(speeds, [p["dte_rms_um"] if p["stable"] else np.nan for p in branch], **line)
        left.set(xlabel="Mesh cycles [-]", ylabel="Mesh stiffness [N/µm]")
        right.set(xlabel="Mesh over natural frequency [-]", ylabel="Dynamic transmission error, rms [µm]")
        right.set_ylim(bottom=0.0)
    return figure
