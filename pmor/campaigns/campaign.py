"""A campaign that was read: its kind, its base file and its table of designs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from pmor.campaigns.keys import split
from pmor.campaigns.kind import Kind, Number
from pmor.campaigns.settings import CampaignSections, GearboxResults
from pmor.core.errors import printable
from pmor.core.shown import Written


@dataclass(frozen=True)
class Span:
    """Values between two bounds, which belong to them.

    Parameters
    ----------
    low, high : int or float
    whole : bool
        Whether all values are whole numbers.
    """

    low: Number
    high: Number
    whole: bool


@dataclass(frozen=True)
class Variable:
    """A key of the base file that differs from design to design.

    Parameters
    ----------
    name : str
        Section and key, such as ``pinion.teeth``.
    values : tuple of numbers, or Span
        The latter in Sobol's sequence alone.
    """

    name: str
    values: tuple[Number, ...] | Span


@dataclass(frozen=True)
class Campaign(Written):
    """A campaign, its base file and its table of designs read.

    Parameters
    ----------
    kind : Kind
    sections : CampaignSections
        The campaign file as it stands.
    inputs : tuple of Path
        Files that were read: of the campaign, of the base file, of the table of designs if it is a CSV file.
    source_text : str
        Of the campaign file.
    text : str
        All that the results are made from: campaign file, table of designs, base file.
    base_text : str
        TOML text of the base file with the keys that all designs have in common; it names no further file.
    variables : tuple of Variable
    count : int
        Number of designs.
    """

    kind: Kind
    sections: CampaignSections
    inputs: tuple[Path, ...]
    source_text: str
    text: str
    base_text: str
    variables: tuple[Variable, ...]
    count: int

    @property
    def name(self) -> str:
        """Stem of the file name."""
        return printable(self.inputs[0].stem)

    @property
    def results(self) -> tuple[str, ...]:
        """Keys of the results that are written, in the order of the tables."""
        said = self.sections.results
        loads = said.loads if isinstance(said, GearboxResults) else ()
        every = chain(self.kind.figures, *(self.kind.of_loads[load] for load in loads))
        return tuple(figure.key for figure in every if split(figure.key)[1] in said.keys)

    @property
    def whole(self) -> tuple[str, ...]:
        """Columns of whole numbers."""
        listed = {v.name: v.values for v in self.variables}
        kinds = {name: values.whole if isinstance(values, Span) else isinstance(values[0], int)
                 for name, values in listed.items()}  # fmt: skip
        return tuple(name for name in self.columns if kinds.get(name, name.endswith(".teeth")))

    @property
    def columns(self) -> tuple[str, ...]:
        """Keys of the base file that differ between designs, or follow from relations."""
        named = tuple(variable.name for variable in self.variables)
        return named + tuple(name for name in self.sections.relations.derived if name not in named)
