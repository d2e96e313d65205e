"""The README's table of figures as tiles for the start page, so that a figure stands in one place alone."""

import re
from html import escape


def tiles(readme: str) -> str:
    """HTML of the table's rows: what is ours, large, what it is, what others have, and the command that measures it."""
    rows = re.findall(r"^\| (.+?) \| (.+?) \| (.*?) ?\| `(make .*?)` \|$", readme, re.MULTILINE)
    return "\n".join(['<div class="figures">', *(_tile(*row) for row in rows), "</div>"])


def _tile(figure: str, ours: str, others: str, command: str) -> str:
    more = f"<small>{escape(others)}</small>" if others else ""
    return f"<p><b>{escape(ours)}</b> {escape(figure)}{more}<small><code>{escape(command)}</code></small></p>"
