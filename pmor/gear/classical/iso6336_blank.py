"""What ISO 6336 makes of a light blank: factors of stiffness and of root stress for a web and a thin rim."""

from __future__ import annotations

import math

# Web over face width, and rim over normal module, between which the factor of stiffness is stated; the nearest value
# counts beyond.
WEB, LEAST_RIM = (0.2, 1.2), 1.0
# Rim over tooth height from which a rim does not raise the root stress, and below which the standard has no factor.
THICK, THINNEST = 1.2, 0.5


def web_factor(web_over_width: float, rim_in_modules: float) -> float:
    """Gear blank factor C_R of the stiffness c': 1 for solid discs.

    Source: ISO 6336-1:2006, clause 9: C_R = 1 + ln(b_s/b) / (5 exp(s_R / (5 m_n))).

    Parameters
    ----------
    web_over_width : float
        b_s / b, thickness of the web over face width.
    rim_in_modules : float
        s_R / m_n, thickness of the rim below the root circle.
    """
    web = min(max(web_over_width, WEB[0]), WEB[1])
    return 1.0 + math.log(web) / (5.0 * math.exp(max(rim_in_modules, LEAST_RIM) / 5.0))


def rim_factor(rim_over_height: float) -> float | None:
    """Rim thickness factor Y_B of the root stress of external gears; None of rims that the standard bids to avoid.

    Source: ISO 6336-3:2019: Y_B = 1.6 ln(2.242 h_t / s_R) for 0.5 < s_R / h_t < 1.2, 1 above.

    Parameters
    ----------
    rim_over_height : float
        s_R / h_t, thickness of the rim below the root circle over the height of a tooth.
    """
    if rim_over_height >= THICK:
        return 1.0
    return 1.6 * math.log(2.242 / rim_over_height) if rim_over_height >= THINNEST else None
