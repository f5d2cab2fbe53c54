"""Pictures in space have no ground: they are read on light and on dark pages."""

import io

import numpy as np
from PIL import Image

from pmor.report.style import new_figure, picture_bytes, plot_style, see_through


def pixels(clear):
    """A figure with a square and a title, as its file has it."""
    with plot_style():
        figure = new_figure(2.0, 2.0)
        axes = figure.subplots()
        axes.fill([0.2, 0.8, 0.8, 0.2], [0.2, 0.2, 0.8, 0.8], facecolor="#3b528b")
        axes.set_title("mode 1")
        axes.axis("off")
        if clear:
            see_through(figure)
    return np.asarray(Image.open(io.BytesIO(picture_bytes(figure, "png"))).convert("RGBA"))


def test_a_clear_picture_has_no_ground_and_keeps_the_colours_of_its_bodies():
    found, white = pixels(True), pixels(False)
    ground = (white[..., :3] == 255).all(axis=2)
    assert (found[ground][:, 3] == 0).all()
    assert tuple(found[110, 110]) == tuple(white[110, 110]) == (0x3B, 0x52, 0x8B, 255)
