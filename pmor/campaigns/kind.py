"""What the designs of a campaign are: gear pairs, planetary sets or gearboxes, with keys, relations and results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pmor.results.quantities import Quantity

if TYPE_CHECKING:
    from pmor.campaigns.settings import CampaignSections
    from pmor.storage.gear_store import Store

Number = int | float
Design = Mapping[str, Number]
# Results that the best designs are judged by again on fine angles, and these angles.
PEAKS = ("ste_peak_to_peak_um", "ste_peak_to_peak_worst_um")
ANGLES = "angles_per_pitch"


class Solved(NamedTuple):
    """Results of a design, None where it asks for none; why they do not count, where positions did not converge."""

    results: Mapping[str, float | None]
    failure: str = ""


class Cost(NamedTuple):
    """Time of a design, s.

    Parameters
    ----------
    solved : float
        Beside finite elements.
    elements : mapping of str to float
        Of finite elements, by what tells those apart that designs share.
    finely : float
        Of its `PEAKS` on fine angles, beside finite elements.
    """

    solved: float
    elements: Mapping[str, float]
    finely: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of designs; `text` is that of the base file of a design, `name` the design in messages.

    Parameters
    ----------
    key : {"case", "set", "gearbox"}
        Key of a campaign file that names the base file, and what that is.
    gear : str
        Section of its first gear.
    sections : type
        Of the campaign file.
    known : mapping of str to type
        Sections of the base file whose keys designs may change.
    figures : tuple of Quantity
        All results, in the order of the tables.
    of_loads : mapping of str to tuple of Quantity
        Of gearboxes: results of each load by itself, by its name.
    first : tuple of str
        Results in the order in which an engineer looks at them: the first two are the axes of the scatter.
    base_text : callable
        (path, relations, keys that all designs have in common, place for messages) to the text of the base file; raises
        CaseError.
    complete : callable
        (base text, design, relations) to all keys, those that follow from relations included; raises GeometryError.
    text : callable
        (base text, keys) to `text`.
    why : callable
        (reason, base text, keys, relations) to the reason with what relations made of the design.
    refuse : callable
        (text, name): raises what a design cannot be made for, as far as this shows before it is meshed.
    cost : callable
        (text, name, keys of the results that are asked for) to the `Cost` of a design.
    solve : callable
        (text, name, store, keys of the results that are asked for).
    peaks : callable
        (text, name, store) to `PEAKS` on fine angles, and `ANGLES`; raises ConvergenceError.
    of_base : callable
        (base file) to the kind with the keys and results of that file; None where all have the same.
    files : callable
        (text, stem) to the texts of the files of a design by what follows the stem in their names.
    """

    key: str
    gear: str
    sections: type[CampaignSections]
    known: Mapping[str, type]
    figures: tuple[Quantity, ...]
    first: tuple[str, ...]
    base_text: Callable[[Path, Any, Mapping[str, Any], str], str]
    complete: Callable[[str, Design, Any], dict[str, Number]]
    text: Callable[[str, Design], str]
    why: Callable[[str, str, Design, Any], str]
    refuse: Callable[[str, str], None]
    cost: Callable[[str, str, tuple[str, ...]], Cost]
    solve: Callable[[str, str, Store, tuple[str, ...]], Solved]
    peaks: Callable[[str, str, Store], Mapping[str, float]]
    of_base: Callable[[Path], Kind] | None = None
    of_loads: Mapping[str, tuple[Quantity, ...]] = field(default_factory=dict)
    files: Callable[[str, str], dict[str, str]] = lambda text, stem: {".toml": text}

    def figure(self, key: str) -> Quantity:
        """Return the name of a result."""
        return next(figure for figure in chain(self.figures, *self.of_loads.values()) if figure.key == key)
