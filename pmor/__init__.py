"""Static transmission error of gear pairs: full finite-element contact once, then a reduced model in microseconds.

    import pmor

    case = pmor.load_case("cases/paper_spur.toml")
    model = pmor.train(case)
    result = model.sweep(torques_Nm=[50, 100, 150])
    result.plot_ste()

Cases
    `load_case` reads a case file, `make_case` makes a `Case` from keywords, `change_case` changes one by keywords,
    `import_rexs` makes one of a stage in a gearbox file.
Models
    `train` solves full FE over the training of a case and gives a `ReducedModel`; `load_model` reads one that was saved.
    `full_model` gives the full FE of a case, a `FullModel`. Both have `sweep`; a reduced one `sweep_conditions` too,
    over thousands of modifications and misalignments in one call; `export` writes it for other programs, `report`
    leaves what a run does, `dynamics` is the pair in motion over its speed, `design` searches for modifications.
Results
    `SweepResult`: named arrays, figures over the pitch, pictures, CSV. `compare` holds a reduced model against full FE:
    a `Comparison`. `ConditionsResult`: of many conditions. `RootStress`: along the fillets
    (`ReducedModel.root_stress`). `DynamicsResult`: responses over the speed. `DesignResult`: variants and the best.
Campaigns
    `campaign` solves a table of macro-geometries on any `concurrent.futures.Executor`: a `CampaignResult`.
Conditions
    `Misalignment`: where the wheel's axis is. `Modification`: what a gear's flanks deviate by; `Topography`: on a grid.
    `Assembly`: all of it.
Errors
    `PmorError` is the base of all that an engineer can mend: `CaseError`, `GeometryError`, `MeshError`,
    `FileFormatError`, `OutputError`; `ConvergenceError` where no equilibrium was found.

Units in names are those of the values; what has none in its name is in mm, N, MPa or rad (`pmor.core.conventions`). What
runs long takes a `concurrent.futures.Executor` and a callback for progress. Nothing heavy is imported before its use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pmor.core.version import __version__

if TYPE_CHECKING:
    from pmor.app.full import FullModel, full_model
    from pmor.app.model import ReducedModel, compare, load_model, train
    from pmor.app.result import ConditionsResult, SweepResult
    from pmor.app.rexs import import_rexs
    from pmor.campaigns.result import CampaignResult
    from pmor.campaigns.run import campaign
    from pmor.case import Case, change_case, load_case, make_case
    from pmor.core.errors import (
        CaseError,
        ConvergenceError,
        FileFormatError,
        GeometryError,
        MeshError,
        OutputError,
        PmorError,
    )
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult
    from pmor.gear.condition import Assembly, Misalignment
    from pmor.gear.modification import Modification
    from pmor.gear.topography import Topography
    from pmor.results.root_stress import RootStress
    from pmor_online.compare import Comparison

_HOMES = {
    "pmor.design.result": ("DesignResult",),
    "pmor.campaigns.result": ("CampaignResult",),
    "pmor.campaigns.run": ("campaign",),
    "pmor.app.full": ("FullModel", "full_model"),
    "pmor.app.model": ("ReducedModel", "compare", "load_model", "train"),
    "pmor.app.rexs": ("import_rexs",),
    "pmor.dynamics.result": ("DynamicsResult",),
    "pmor.app.result": ("ConditionsResult", "SweepResult"),
    "pmor.case": ("Case", "change_case", "load_case", "make_case"),
    "pmor.gear.condition": ("Misalignment", "Assembly"),
    "pmor.core.errors": (
        "CaseError", "ConvergenceError", "FileFormatError", "GeometryError", "MeshError", "OutputError", "PmorError",
    ),
    "pmor.gear.modification": ("Modification",),
    "pmor.gear.topography": ("Topography",),
    "pmor.results.root_stress": ("RootStress",),
    "pmor_online.compare": ("Comparison",),
}  # fmt: skip
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Misalignment",
    "Assembly",
    "CampaignResult",
    "Case",
    "CaseError",
    "Comparison",
    "ConditionsResult",
    "ConvergenceError",
    "DesignResult",
    "DynamicsResult",
    "FileFormatError",
    "FullModel",
    "GeometryError",
    "MeshError",
    "Modification",
    "OutputError",
    "PmorError",
    "ReducedModel",
    "RootStress",
    "SweepResult",
    "Topography",
    "__version__",
    "campaign",
    "change_case",
    "compare",
    "full_model",
    "import_rexs",
    "load_case",
    "load_model",
    "make_case",
    "train",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'pmor' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
