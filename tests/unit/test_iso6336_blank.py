"""Factors of ISO 6336 for light blanks, as three public programs tabulate them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.classical.iso6336 import rim_factor, web_factor

# Half of the fourth digit.
DIGITS = 5.001e-5
WEBS, RIMS = (0.2, 0.4, 0.6, 0.8), (1.0, 2.0, 4.0, 7.0)
C_R = [
    [0.7365, 0.7842, 0.8554, 0.9206],
    [0.8500, 0.8772, 0.9177, 0.9548],
    [0.9164, 0.9315, 0.9541, 0.9748],
    [0.9635, 0.9701, 0.9799, 0.9890],
]
Y_B = {0.5: 2.4008, 0.6: 2.1091, 0.8: 1.6488, 1.0: 1.2918, 1.2: 1.0}


def test_webs_soften_teeth_as_tabulated():
    assert_allclose([[web_factor(web, rim) for rim in RIMS] for web in WEBS], C_R, rtol=0.0, atol=DIGITS)


def test_beyond_its_range_the_nearest_web_and_rim_count():
    assert web_factor(0.05, 0.3) == web_factor(0.2, 1.0)
    assert web_factor(2.0, 4.0) == web_factor(1.2, 4.0) > 1.0
    assert web_factor(1.0, 4.0) == 1.0


@pytest.mark.parametrize("rim", Y_B)
def test_thin_rims_raise_root_stress_as_tabulated(rim):
    assert_allclose(rim_factor(rim), Y_B[rim], rtol=0.0, atol=DIGITS)


def test_thick_rims_do_not_raise_root_stress_and_thinner_ones_than_half_a_tooth_are_not_rated():
    assert rim_factor(3.0) == 1.0
    assert_allclose(rim_factor(1.2 - 1e-9), 1.0, atol=3e-3)  # the standard's two branches nearly meet
    assert rim_factor(0.49) is None


def test_thinner_rims_are_never_better():
    assert (np.diff([rim_factor(rim) for rim in np.linspace(0.5, 2.0, 40)]) <= 1e-3).all()
