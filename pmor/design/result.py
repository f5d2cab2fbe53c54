"""The result of a search of flank modifications: its arrays and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.shown import Columns
from pmor.design.figures import front_figure
from pmor.design.output import FILES, design_data, design_text, write_design
from pmor.design.readings import Readings
from pmor.design.variants import Found
from pmor.report.curves import Drawn
from pmor.report.replay import draw_into, styled
from pmor.results.tabular import headed
from pmor.work.results import writing_results

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class DesignResult(Drawn):
    """Variants of the flank modifications of a pair, a gearbox or a set: V of n variables under T torques."""

    found: Found
    read: Readings

    @property
    def x(self) -> FloatArray:
        """Values of the variables, shape (V, n), each in its unit."""
        return self.found.variants.x

    @property
    def objective(self) -> FloatArray:
        """The minimised value, shape (V,), um or 1; NaN without a solution."""
        return self.found.variants.objective

    @property
    def best(self) -> int | None:
        """Number of the best variant that keeps all constraints; None if none does."""
        return self.found.best

    @property
    def front(self) -> IntArray:
        """Numbers of the variants on the Pareto front."""
        return self.found.front

    @property
    def data(self) -> Mapping[str, Any]:
        """Figures as plain data: the content of `design.json`."""
        return design_data(self.found, self.read)

    @property
    def failures(self) -> tuple[str, ...]:
        """Variants without a solution, pieces of the search that stopped, readings that are missing, and why."""
        return self.found.failures + self.read.failures

    def result(self, key: str) -> FloatArray:
        """Return one result, such as ``peak_to_peak_um``, of all variants as drawn, shape (V, T)."""
        return np.asarray(self.found.variants.results[:, :, self.found.design.results.index(key)])

    def assembly(self, variant: int) -> Any:
        """Return the `Assembly` of a variant, for `ReducedModel.sweep_conditions`; of several meshes what is built."""
        built = self.found.judge.assembly(self.x[variant])
        return built.flanks[0] if len(built.flanks) == 1 else built

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `design.h5`, `design.csv`, `design.json`, `design.md`, `report.html` and the pictures.

        Finished pieces are removed; they stay where something failed: the next run takes them over.

        Parameters
        ----------
        overwrite : bool
            Replace files of these names whoever wrote them.

        Raises
        ------
        OutputError
        """
        file, complete = self.found.file, not self.failures
        with writing_results(
            folder, FILES, file.text, inputs=file.inputs, overwrite=overwrite, complete=complete
        ) as out:
            self.write_into(out)

    def write_into(self, folder: Path) -> None:
        """Write the files into a folder that this process holds; OutputError where that fails."""
        write_design(self.found, self.read, folder)

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each variant."""
        design = self.found.design
        results = {
            f"{key}_at_{load}": self.result(key)[:, t]
            for key in design.results for t, load in enumerate(design.load.columns)
        }  # fmt: skip
        variables = {variable.name: self.x[:, n] for n, variable in enumerate(design.variables)}
        origin = list(self.found.variants.origin)
        named = {"variant": np.arange(len(self.x)), "origin": origin}
        return {**named, **variables, design.objective.column: self.objective, **results}

    def _shown(self) -> Columns:
        return headed({key: np.asarray(values)[self.front] for key, values in self.columns().items()})

    def _draw(self, axes: Axes, style: Mapping[str, Any]) -> None:
        """Draw all variants by the objective and the result weighed against it, with the front and the best."""
        draw_into(styled(front_figure(self.found), style), [axes])
        axes.legend()

    def __repr__(self) -> str:
        unit = self.found.design.objective.unit and " um"
        least = "none keeps the constraints" if self.best is None else f"best {self.objective[self.best]:.4g}{unit}"
        return f"<DesignResult of {self.found.file.words.name!r}: {len(self.x)} variants, {least}>"

    def __str__(self) -> str:
        return design_text(self.found, self.read)
