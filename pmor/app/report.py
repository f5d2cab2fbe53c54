"""The results folder of a run, from a model of the Python API."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pmor.case import text_of
from pmor.storage.results_folder import results_folder, start_results

if TYPE_CHECKING:
    from pmor.app.model import ReducedModel
    from pmor.pair.model import ElasticModel

BASIS = "basis.h5"


def write_report(model: ReducedModel, elastic: ElasticModel | None, folder: Path, overwrite: bool) -> Path:
    """Write what `pmor run` leaves; see `ReducedModel.report`."""
    from pmor.report.run_page import page_files, write_pages
    from pmor.report.summary import result_files, write_results
    from pmor_online.compare import compare_models
    from pmor_online.conditions import sweep_listed
    from pmor_online.run import OnlineResult, sweep_case

    case, reduced = model.case, model.reduced
    files = (*result_files(case), *page_files(case), BASIS)
    with results_folder(folder, files, (), overwrite):
        model.save(folder / BASIS, overwrite=True)
        result = OnlineResult(
            reduced, sweep_case(reduced), compare_models(reduced, elastic) if elastic else None,
            (folder / BASIS).stat().st_size / 2**20,
            conditions=sweep_listed(reduced) if case.conditions else (), basis_name=BASIS,
        )  # fmt: skip
        start_results(folder, text_of(case))
        write_results(result, folder)
        write_pages(result, elastic.mesh.pinion if elastic else None, folder)
    return folder / "report.html" if case.output.report else folder
