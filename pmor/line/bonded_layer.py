"""An elastic layer bonded to a rigid base, in plane strain: how far its surface goes down under a load."""

from __future__ import annotations

from functools import cache

import numpy as np

from pmor.core.arrays import FloatArray

# Half-width of the contact over the depth of the layer, beyond which the closed form is refused (`pmor.line.hertz`).
WIDEST = 0.5


def layer_transform(wavenumber: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return L(k) of a layer one unit deep: k c / 2 L its surface's displacement by a pressure cos(k x); 1 far out.

    Johnson, Contact Mechanics, 1985, ch. 5, as in `pmor.line.hertz`, equation (2).
    """
    kappa, y = 3.0 - 4.0 * poisson_ratio, wavenumber
    numerator = 2.0 * kappa * np.sinh(2.0 * y) - 4.0 * y
    return np.asarray(numerator / (2.0 * kappa * np.cosh(2.0 * y) + 4.0 * y**2 + 1.0 + kappa**2))


@cache
def bonded_layer_constant(poisson_ratio: float) -> float:
    """Return the constant a(nu) of a line load on a layer bonded to a rigid base (`pmor.line.hertz`, equation 2)."""
    abscissas, weights = np.polynomial.legendre.leggauss(60)
    near = 0.5 + 0.5 * abscissas
    below = float(np.sum(0.5 * weights * layer_transform(near, poisson_ratio) / near))
    far = 1.0 + 10.0 * (1.0 + abscissas)  # beyond y = 21 the transform is 1 to sixteen digits
    above = float(np.sum(10.0 * weights * (layer_transform(far, poisson_ratio) - 1.0) / far))
    return below + above - float(np.euler_gamma)
