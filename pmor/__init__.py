"""Static transmission error of gear pairs: full finite-element contact once, then a reduced model in microseconds.

    import pmor

    case = pmor.load_case("cases/paper_spur.toml")
    model = pmor.train(case)
    result = model.sweep(torques_Nm=[50, 100, 150])
    result.plot_ste()

Machines, whatever they are
    `make`: makes a pair, a planetary set, a train or a gearbox from sections as files have them, or keywords; `change`:
    changes any of them.
Cases
    `load_case`: reads a case file. `make_case`: makes a `Case` from keywords. `change_case`: changes one by keywords.
    `import_rexs`: makes one of a stage in a gearbox file. `geometry`: the data sheet of its gears, a `Geometry`.
Files of any kind
    `load`: reads a case, a planetary set, a gearbox, a design, a campaign or a study. `plan`: its work, memory and
    time. `run`: all that it asks for, with its files; of a gearbox a `GearboxResult`, of a planetary set or idlers a
    `SetResult`.
Models
    `train`: solves full FE over the training of a case; a `ReducedModel`, with `sweep`, `sweep_conditions`,
    `root_stress`, `report`, `export`, `dynamics`, `design`; of a set or a gearbox a `MachineModel`, with `sweep` and
    `sweep_conditions`. `load_model`: reads one from a file. `full_model`: full FE
    of a case, a `FullModel`. `compare`: a reduced model beside full FE, a `Comparison`.
    `run_case`: all that a case asks for, with its files; a `RunResult`.
Results
    `SweepResult`: transmission error, load sharing, stiffness over angles and torques. `ConditionsResult`: of many
    assemblies; `VariantsResult`: of several sets or gearboxes. `RootStress`: along the fillets.
Capabilities and experiments, with their files where a folder is given
    `run_dynamics`: a pair in motion, a `DynamicsResult`, or a gearbox, a `MotionResult`. `run_design`: a search for
    flank modifications, a `DesignResult`. `campaign`: a table of macro-geometries, a `CampaignResult`.
    `study`: a grid of meshes and models. `convergence`: finer and finer meshes. `stability`: extreme variants.
    `reductions`: reductions and samplings. `bench`: run times.
    `write_design_case`, `write_campaign_case`: one of many designs as a case file.
Conditions
    `Misalignment`: position of the wheel's axis. `Modification`: deviation of a gear's flanks; `Topography`: on a grid,
    `Wave`: around a gear. `Assembly`: misalignment and both modifications.
Files
    `load_results`: arrays of a results file by name, each a `ResultArray`. `info`: content of a file. `verify`:
    compares a basis file with full FE, a `Verification`. `export_file`: writes a file in the format of another program.
    `diff`: two folders of results beside each other, `Differences`.
Other programs
    `exudyn_mesh`: a mesh as a connector of two bodies in exudyn, a package for multibody dynamics.
Errors
    `PmorError`: base of all that an engineer can mend. `CaseError`, `GeometryError`, `MeshError`: in the settings.
    `FileFormatError`, `OutputError`: in files. `ConvergenceError`: no equilibrium found. `ExternalProgramError`: a
    program to compare with is missing or failed.

Units in names are those of the values; names without one are in mm, N, MPa or rad (`pmor.core.conventions`).
Long work takes ``executor``, a `concurrent.futures.Executor` of threads, and ``progress``, called with the number of
steps done. `run_dynamics` takes one of processes, `campaign` any: these start processes, which import the script anew,
so that its calls belong below ``if __name__ == "__main__":``.
Notes beside the results go to the log ``pmor``. Nothing heavy is imported before its use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pmor.core.version import __version__

if TYPE_CHECKING:
    from pmor.app.capabilities import (
        bench,
        campaign,
        convergence,
        load,
        plan,
        reductions,
        run,
        run_design,
        run_dynamics,
        stability,
        study,
        write_campaign_case,
        write_design_case,
    )
    from pmor.app.cases import change, change_case, make, make_case
    from pmor.app.diff import Differences, diff
    from pmor.app.export import export_file, import_rexs
    from pmor.app.exudyn import exudyn_mesh
    from pmor.app.files import Verification, info, load_results, verify
    from pmor.app.full import FullModel, full_model
    from pmor.app.geometry import Geometry, geometry
    from pmor.app.machine_model import MachineModel, VariantsResult
    from pmor.app.model import ReducedModel
    from pmor.app.result import ConditionsResult, SweepResult
    from pmor.app.run import RunResult, run_case
    from pmor.app.training import compare, load_model, train
    from pmor.campaigns.result import CampaignResult
    from pmor.case import Case, load_case
    from pmor.core.errors import (
        CaseError,
        ConvergenceError,
        ExternalProgramError,
        FileFormatError,
        GeometryError,
        MeshError,
        OutputError,
        PmorError,
    )
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult
    from pmor.dynamics.whine.result import MotionResult
    from pmor.export.tables import ResultArray
    from pmor.gear.condition import Assembly, Misalignment
    from pmor.gear.modification import Modification, Wave
    from pmor.gear.topography import Topography
    from pmor.machine.result import GearboxResult
    from pmor.results.root_stress import RootStress
    from pmor.sets.result import SetResult
    from pmor_online.compare import Comparison

_HOMES = {
    "pmor.design.result": ("DesignResult",),
    "pmor.campaigns.result": ("CampaignResult",),
    "pmor.app.diff": ("Differences", "diff"),
    "pmor.app.export": ("export_file", "import_rexs"),
    "pmor.app.exudyn": ("exudyn_mesh",),
    "pmor.app.files": ("Verification", "info", "load_results", "verify"),
    "pmor.app.full": ("FullModel", "full_model"),
    "pmor.app.geometry": ("Geometry", "geometry"),
    "pmor.app.machine_model": ("MachineModel", "VariantsResult"),
    "pmor.app.model": ("ReducedModel",),
    "pmor.app.capabilities": (
        "bench", "campaign", "convergence", "load", "plan", "reductions", "run", "run_design",
        "run_dynamics", "stability", "study", "write_campaign_case", "write_design_case",
    ),
    "pmor.app.run": ("RunResult", "run_case"),
    "pmor.app.training": ("compare", "load_model", "train"),
    "pmor.dynamics.result": ("DynamicsResult",),
    "pmor.dynamics.whine.result": ("MotionResult",),
    "pmor.app.result": ("ConditionsResult", "SweepResult"),
    "pmor.app.cases": ("change", "change_case", "make", "make_case"),
    "pmor.case": ("Case", "load_case"),
    "pmor.gear.condition": ("Misalignment", "Assembly"),
    "pmor.core.errors": (
        "CaseError", "ConvergenceError", "ExternalProgramError", "FileFormatError", "GeometryError", "MeshError",
        "OutputError", "PmorError",
    ),
    "pmor.export.tables": ("ResultArray",),
    "pmor.gear.modification": ("Modification", "Wave"),
    "pmor.gear.topography": ("Topography",),
    "pmor.machine.result": ("GearboxResult",),
    "pmor.results.root_stress": ("RootStress",),
    "pmor.sets.result": ("SetResult",),
    "pmor_online.compare": ("Comparison",),
}  # fmt: skip
_HOME = {name: module for module, names in _HOMES.items() for name in names}
_MOVED = {"gear_set": "run", "gearbox": "run"}

__all__ = [
    "Assembly", "CampaignResult", "Case", "CaseError", "Comparison", "ConditionsResult", "ConvergenceError",
    "DesignResult", "Differences", "DynamicsResult", "ExternalProgramError", "FileFormatError", "FullModel",
    "GearboxResult", "Geometry", "GeometryError", "MachineModel", "MeshError", "Misalignment", "Modification",
    "MotionResult", "OutputError", "PmorError", "ReducedModel", "ResultArray", "RootStress", "RunResult",
    "SetResult", "SweepResult", "Topography", "VariantsResult", "Verification", "Wave", "bench", "campaign",
    "change", "change_case", "compare", "convergence", "diff", "export_file", "exudyn_mesh", "full_model",
    "geometry", "import_rexs", "info", "load", "load_case", "load_model", "load_results", "make", "make_case",
    "plan", "reductions", "run", "run_case", "run_design", "run_dynamics", "stability", "study", "train", "verify",
    "write_campaign_case", "write_design_case", "__version__",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        from pmor.core.wording import did_you_mean

        remedy = f"use pmor.{_MOVED[name]}" if name in _MOVED else did_you_mean(name, __all__)
        raise AttributeError(f"module 'pmor' has no attribute {name!r}: {remedy}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
