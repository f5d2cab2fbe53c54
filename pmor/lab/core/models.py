"""Full models that variants of a case share."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, field

from pmor.case import Case
from pmor.case.width import meshed_width
from pmor.pair.model import ElasticModel, elastic_model, mesh_model
from pmor.work.cost import meshed_within_memory


@dataclass
class ModelStore:
    """Elastic models by the keys that they depend on: most variants change the contact alone, and share one.

    Line contact takes the surface layer's compliance out of the elastic model, and has its own.
    """

    # Filled on the way: elastic model and the seconds it took
    models: dict[str, tuple[ElasticModel, float]] = field(default_factory=dict)

    def model(self, case: Case) -> tuple[ElasticModel, float]:
        """Return the full model of a case and the wall time of its finite elements, meshing included, s."""
        key = _body_key(case)
        if key not in self.models:
            started = time.perf_counter()
            model = elastic_model(case, meshed_within_memory(case))
            self.models[key] = model, time.perf_counter() - started
        model, seconds = self.models[key]
        return ElasticModel(mesh_model(case), model.pinion, model.wheel), seconds


def _body_key(case: Case) -> str:
    """Everything that mesh and compliance depend on; the width that is meshed is not only the mesh section's."""
    layer = case.contact.layer_depth if case.contact.scheme == "line" else None
    return json.dumps([asdict(case.pair), asdict(case.mesh), meshed_width(case), layer], sort_keys=True)
