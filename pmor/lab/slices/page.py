"""The page on thin slices: the effect of the coupling of teeth and sections on motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.case import Case, text_of
from pmor.dynamics.measure import Data
from pmor.report.page import Block, Picture
from pmor.report.style import COLOURS, new_figure, plot_style
from pmor.work.results import Report, writing_results
from pmor.work.table import Columns, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: files of the experiment
FILES = "slices.json", "slices.md", "report.html", "slices.png"
# Kinds of law, and how their lines look.
KINDS = {"coupled": ("coupled", "-"), "slices": ("thin slices", "--")}


def write_slices(case: Case, slices: Sequence[Data], folder: Path) -> None:
    """Write `slices.json`, `slices.md`, `report.html` and the picture.

    Parameters
    ----------
    case : Case
    slices : sequence of dict
        One per torque; see `pmor.lab.slices.run.run_slices`.
    folder : Path

    Raises
    ------
    OutputError
    """
    data = {"case": case.name, "thin_slices": list(slices)}
    with writing_results(folder, FILES, text_of(case)) as out:
        Report("slices", data, f"Thin slices in motion: {case.title}", _blocks(slices), case).write(out)


def _blocks(slices: Sequence[Data]) -> list[Block]:
    return [
        _words(slices),
        Picture(
            "slices.png", "Tangent stiffness at rest over the mesh cycle, and the stable response at "
            f"{_percent(_highest(slices))} damping over the natural frequency of each: coupled (solid), thin slices "
            "(dashed).", _figure(slices),
        ),
        table("Coupled and in slices", _columns(), _rows(slices),
              "Folds of the main resonance, over the natural frequency of each law; empty: no jump."),
    ]  # fmt: skip


def _words(slices: Sequence[Data]) -> str:
    swings = [[_swing(found[kind]) for kind in KINDS] for found in slices]
    ratio = _highest(slices)
    jumps = [[_fold(found[kind], _at(found[kind], ratio), "run_up") is not None for found in slices] for kind in KINDS]
    return (
        "The same pair without coupling between teeth and between sections, as thin slices have none. An even load on "
        "a single pair of teeth bends it as before; with two pairs neither sinks under the load of the other, and the "
        "mesh is stiffer there. Its stiffness "
        f"swings by {_span([100.0 * alone for _, alone in swings])} % of its mean, with the coupling by "
        f"{_span([100.0 * coupled for coupled, _ in swings])} %; at {_percent(ratio)} damping "
        f"{sum(jumps[1])} of {len(slices)} torques jump, with the coupling {sum(jumps[0])}.{_calmest(slices)}"
    )


def _calmest(slices: Sequence[Data]) -> str:
    """Say under which torque either law vibrates least: relief suits a smaller one where the mesh is stiffer."""
    if len(slices) == 1:
        return ""
    calm = {}
    for kind in KINDS:
        sizes = [_largest(_at(found[kind], _highest(slices))) or np.inf for found in slices]
        calm[kind] = slices[int(np.argmin(sizes))]["torque_Nm"]
    return (
        f" The largest transmission error is least under {calm['slices']:g} N m in slices and under "
        f"{calm['coupled']:g} N m with the coupling."
    )


def _columns() -> Columns:
    return {
        "torque, N m": lambda row: row[0]["torque_Nm"],
        "law": lambda row: KINDS[row[1]][0],
        "natural frequency, Hz": lambda row: row[0][row[1]]["natural_frequency_Hz"],
        "mean stiffness, N/µm": lambda row: row[0][row[1]]["mesh_stiffness_mean_N_per_um"],
        "swing of it, %": lambda row: 100.0 * _swing(row[0][row[1]]),
        "its rms, %": lambda row: 100.0 * _rms(row[0][row[1]]),
        "damping, %": lambda row: 100.0 * row[2]["damping_ratio"],
        "jump up at": lambda row: _fold(row[0][row[1]], row[2], "run_up"),
        "jump down at": lambda row: _fold(row[0][row[1]], row[2], "run_down"),
        "largest DTE rms, µm": lambda row: _largest(row[2]),
    }


def _rows(slices: Sequence[Data]) -> list[tuple[Data, str, Data]]:
    return [(found, kind, damped) for found in slices for kind in KINDS for damped in found[kind]["responses"]]


def _swing(law: Data) -> float:
    """How far the stiffness swings over the mesh cycle, over its mean."""
    return float((law["mesh_stiffness_max_N_per_um"] - law["mesh_stiffness_min_N_per_um"])
                 / law["mesh_stiffness_mean_N_per_um"])  # fmt: skip


def _rms(law: Data) -> float:
    """Root mean square of the stiffness about its mean, over its mean."""
    stiffness = np.array(law["mesh_stiffness_N_per_um"])
    return float(stiffness.std() / stiffness.mean())


def _fold(law: Data, damped: Data, kind: str) -> float | None:
    """Highest frequency at which motion jumps, over the natural one: superharmonics jump below."""
    found = [fold["mesh_frequency_Hz"] for fold in damped["folds"] if fold["kind"] == kind]
    return max(found) / law["natural_frequency_Hz"] if found else None


def _largest(damped: Data) -> float | None:
    return max((point["dte_rms_um"] for point in damped["branch"] if point["stable"]), default=None)


def _at(law: Data, ratio: float) -> Data:
    """Response at a damping ratio."""
    return dict(next(damped for damped in law["responses"] if damped["damping_ratio"] == ratio))


def _highest(slices: Sequence[Data]) -> float:
    return float(max(damped["damping_ratio"] for damped in slices[0]["coupled"]["responses"]))


def _percent(ratio: float) -> str:
    return f"{100.0 * ratio:g} %"


def _span(values: Sequence[float]) -> str:
    return f"{min(values):.3g} to {max(values):.3g}" if len(values) > 1 else f"{values[0]:.3g}"


def _figure(slices: Sequence[Data]) -> Figure:
    from matplotlib.lines import Line2D

    ratio = _highest(slices)
    with plot_style():
        figure = new_figure(9.2, 4.4)
        left, right = figure.subplots(1, 2)
        for place, found in enumerate(slices):
            colour = COLOURS[place % len(COLOURS)]
            for kind, (_, dashes) in KINDS.items():
                _draw(left, right, found[kind], ratio, {"color": colour, "lw": 1.2, "ls": dashes})
        left.set_xlabel("Mesh cycles [-]")
        left.set_ylabel("Mesh stiffness [N/µm]")
        right.set_xlabel("Mesh over natural frequency [-]")
        right.set_ylabel("Dynamic transmission error, rms [µm]")
        right.set_ylim(bottom=0.0)
        handles = [Line2D([], [], color=COLOURS[i % len(COLOURS)], label=f"{found['torque_Nm']:g} N m")
                   for i, found in enumerate(slices)]  # fmt: skip
        handles += [Line2D([], [], color="#555555", label=name, ls=dashes) for name, dashes in KINDS.values()]
        figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _draw(left: Any, right: Any, law: Data, ratio: float, line: dict[str, Any]) -> None:
    stiffness = law["mesh_stiffness_N_per_um"]
    left.plot(np.arange(len(stiffness)) / len(stiffness), stiffness, **line)
    branch = _at(law, ratio)["branch"]
    sizes = np.array([point["dte_rms_um"] if point["stable"] else np.nan for point in branch])
    right.plot(np.array([p["mesh_frequency_Hz"] for p in branch]) / law["natural_frequency_Hz"], sizes, **line)
