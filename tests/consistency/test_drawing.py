"""Pictures that a copy of the process draws are those that this one would."""

import subprocess
import sys

import pytest

CODE = """
import os
from pmor.report import drawing
from pmor.report.page import Picture
from pmor.report.style import new_figure, plot_style

def pictures():
    for n in range(3):
        with plot_style():
            figure = new_figure(3.0, 2.0)
            figure.add_subplot().plot([0.0, 1.0], [0.0, n])
        yield Picture(f"{n}.png", "words", figure)

here = os.getpid()
class Fails(Picture):
    def content(self, picture_format):
        if os.getpid() != here:
            raise MemoryError
        return super().content(picture_format)

formats = ("png", "svg")
drawing._copies = lambda: 0
alone = list(pictures()); drawing.draw(alone, formats)
drawing._copies = lambda: 2
content, seen = drawing.Picture.content, []
shared = list(pictures())
drawing.Picture.content = lambda self, kind: seen.append(kind not in self.drawn) or content(self, kind)
drawing.draw(shared, formats)
assert sum(seen) == 2, seen  # one of three, in two formats
drawing.Picture.content = content
failed = [Fails(p.file_name, p.caption, p.figure) for p in pictures()]; drawing.draw(failed, formats)
assert [p.drawn for p in alone] == [p.drawn for p in shared] == [p.drawn for p in failed]
assert all(set(p.drawn) == set(formats) for p in alone)
"""


@pytest.mark.slow
def test_pictures_of_a_copy_are_the_same_and_this_process_draws_what_a_copy_cannot():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
