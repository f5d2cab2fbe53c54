"""What gears' flanks are made to deviate by, and what they deviate by against the maker's will, as plain numbers.

The names are those of ISO 21771 and REXS. `pmor.kinematics.flank_deviation` turns them into what the kernels evaluate.
"""

from pmor.flank.modification import UNMODIFIED, Modification
from pmor.flank.topography import Topography

__all__ = ["UNMODIFIED", "Modification", "Topography"]
