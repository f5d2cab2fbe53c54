"""Write the gallery of the manual: pages on a desk and on a phone, light and dark.

    python -m tests.programs.gallery_page FOLDER

FOLDER holds the results of commands of `PAGES`; pages of others keep their pictures. Chromium takes them.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

MANUAL = Path(__file__).resolve().parents[2] / "cases" / "manual"
#: kind of page, and the command that makes it, without its `--out FOLDER/KIND`
PAGES = {
    "pair": "pmor run pair.toml",
    "set": "pmor run cases/planetary_stage.toml",
    "gearbox": "pmor run cases/two_stage_gearbox.toml",
    "motion": "pmor dynamics cases/osu_dynamics.toml",
    "design": "pmor design cases/osu_design.toml",
    "campaign": "pmor campaign cases/planetary_campaign.toml",
}
# Of a screen, px, and by how much a picture of the gallery is smaller; phones are shown in a frame of the page.
SCREENS, SHARE, QUALITY = ((1400, 2000), (390, 2000)), 0.36, 45
# Narrower windows are not given by the browser.
LEAST_PX, GAP_PX = 500, 24
HEAD = """# Gallery

A finished page: [report.html](report.html), of `relief.toml` in the [tutorial](ten_minutes.md). Open it in a browser;
it needs nothing beside it. Each page below is shown on a desk (1400 px) and on a phone (390 px), light and dark, as its
reader's system asks for. Made by `python -m tests.programs.gallery_page FOLDER`.
"""


def shown(page: Path, width: int, height: int, dark: bool) -> Image.Image:
    """Return the picture of a page."""
    with tempfile.TemporaryDirectory() as folder:
        frame, target = Path(folder) / "frame.html", Path(folder) / "page.png"
        style = f"border: 0; width: {width}px; height: {height}px"
        frame.write_text(f'<body style="margin: 0"><iframe src="{page.as_uri()}" style="{style}"></iframe>')
        options = ["--headless", "--no-sandbox", "--hide-scrollbars", f"--screenshot={target}",
                   f"--window-size={max(width, LEAST_PX)},{height}"]  # fmt: skip
        options += ["--blink-settings=preferredColorScheme=0"] * dark
        subprocess.run(["chromium", *options, frame.as_uri()], check=True, capture_output=True)
        with Image.open(target) as picture:
            return picture.convert("RGB").crop((0, 0, width, height))


def picture_of(page: Path) -> Image.Image:
    """Return a page on all screens, light and dark, beside each other."""
    views = [shown(page, *screen, dark) for screen in SCREENS for dark in (False, True)]
    whole = Image.new("RGB", (sum(view.width + GAP_PX for view in views), views[0].height), "#888888")
    left = 0
    for view in views:
        whole.paste(view, (left, 0))
        left += view.width + GAP_PX
    return whole.resize((round(SHARE * whole.width), round(SHARE * whole.height)))


def main() -> None:
    """Write `gallery_KIND.webp` of each page that there is, and `gallery.md`."""
    parts = [HEAD]
    for kind, command in PAGES.items():
        page = (Path(sys.argv[1]) / kind / "report.html").resolve()
        if page.exists():
            picture_of(page).save(MANUAL / f"gallery_{kind}.webp", quality=QUALITY)
        parts.append(f"## {kind.capitalize()}\n\n`{command}`\n\n![Page of a {kind}](gallery_{kind}.webp)\n")
    (MANUAL / "gallery.md").write_text("\n".join(parts) + LAST, encoding="utf-8")


LAST = """
Other pages that commands wrote: [tip relief of the Ohio State pair](../results/osu_design/design.md),
[flanks that fit their gearbox](../results/two_stage_design/design.md),
[of a planetary set](../results/planetary_design/design.md),
[that pair in motion](../results/osu_dynamics/dynamics.md),
[mesh convergence](../results/convergence_paper/convergence.md).
"""

if __name__ == "__main__":
    main()
