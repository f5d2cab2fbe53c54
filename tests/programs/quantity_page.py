"""The table of quantities in `cases/manual/quantities.md`, from `pmor.results.quantities`.

    python -m tests.programs.quantity_page
"""

from pathlib import Path

from pmor.results.quantities import QUANTITIES, SHOWN, Quantity

PAGE = Path(__file__).parents[2] / "cases" / "manual" / "quantities.md"
BEGIN, END = "<!-- made by `python -m tests.programs.quantity_page` -->", "<!-- end of quantities -->"
HEAD = "| key | unit | quantity | meaning | of each | in |\n| --- | --- | --- | --- | --- | --- |\n"


def with_table(text: str) -> str:
    """Return the page with the table between its markers."""
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    rows = "\n".join(map(_row, QUANTITIES))
    return f"{before}{BEGIN}\n\n{HEAD}{rows}\n\n{END}{after}"


def _row(one: Quantity) -> str:
    where = ", ".join(f"`{file}`" for file in one.files) or "campaigns, designs"
    return f"| `{one.key}` | {SHOWN.get(one.unit, one.unit)} | {one.symbol} | {one.words} | {one.per} | {where} |"


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
