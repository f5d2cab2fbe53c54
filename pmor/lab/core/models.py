"""Full models that variants of a case share."""

from __future__ import annotations

import json
import threading
import time
from concurrent.futures import Future
from dataclasses import asdict, replace

from pmor.case import Case
from pmor.case.width import meshed_width
from pmor.pair.model import ElasticModel, elastic_model, mesh_model
from pmor.work.cost import meshed_within_memory

# Of compliances in a store: those of ten models of 64 x 12 elements.
MOST_BYTES = 2 << 30


class ModelStore:
    """Elastic models by the keys that they depend on: most variants change the contact alone, and share one.

    Line contact takes the surface layer's compliance out of the elastic model, and has its own. Threads may share a
    store: each model is solved once. Beyond a limit the models that were not used for longest go.
    """

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._models: dict[str, Future[tuple[ElasticModel, float]]] = {}
        self._most_bytes, self._lock = most_bytes, threading.Lock()

    def model(self, case: Case) -> tuple[ElasticModel, float]:
        """Return the full model of a case and the wall time of its finite elements, meshing included, s."""
        key = _body_key(case)
        with self._lock:
            kept = self._models.pop(key, None)
            future = self._models[key] = kept or Future()  # the last one is the one used last
        if kept is None:
            started = time.perf_counter()
            try:
                solved = elastic_model(case, meshed_within_memory(case))
            except BaseException as error:
                with self._lock:
                    self._models.pop(key, None)
                future.set_exception(error)
            else:
                future.set_result((solved, time.perf_counter() - started))
                self._remove_oldest()
        model, seconds = future.result()
        return replace(model, mesh=mesh_model(case)), seconds

    def _remove_oldest(self) -> None:
        with self._lock:
            sizes = {key: _bytes(future.result()[0]) for key, future in self._models.items() if future.done()}
            for key in list(sizes)[:-1]:
                if sum(sizes.values()) <= self._most_bytes:
                    return
                del self._models[key], sizes[key]


def _bytes(model: ElasticModel) -> int:
    gears = {id(gear): gear for gear in (model.pinion, model.wheel)}  # one object where they are alike
    return sum(gear.compliance.nbytes for gear in gears.values())


def _body_key(case: Case) -> str:
    """Everything that mesh and compliance depend on; the width that is meshed is not only the mesh section's."""
    layer = case.contact.layer_depth if case.contact.scheme == "line" else None
    return json.dumps([asdict(case.pair), asdict(case.mesh), meshed_width(case), layer], sort_keys=True)
