"""Fixed points of a map, found in fewer rounds than by applying it again and again."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray


class Mixing:
    """Places at which a map is tried, by those before (Anderson, J. ACM 12, 1965, 547-560).

    Changes of the residual from round to round are combined to cancel the present one: of a linear map in as many
    rounds as it has directions that return.
    """

    def __init__(self) -> None:
        self._places, self._residuals = list[FloatArray](), list[FloatArray]()

    def next(self, place: FloatArray, image: FloatArray) -> FloatArray:
        """Return where to try next, after a place (n,) was mapped to its image."""
        self._places.append(place)
        self._residuals.append(image - place)
        if len(self._places) == 1:
            return image
        moved, changed = np.diff(self._places, axis=0).T, np.diff(self._residuals, axis=0).T
        share = np.linalg.lstsq(changed, self._residuals[-1], rcond=None)[0]
        return np.asarray(image - (moved + changed) @ share)
