"""Links from "case 12" in the text to the row of that case in the sample of the report."""

import re

from docutils import nodes
from literal_links import is_free

_CASE = re.compile(r"(\bcase \d+\b)")
_REPORT = "samples/report.html"


def link_cases(app, doctree, page):
    """Make links of the cases that the text of ``doctree`` names; what is a link, a title or code stays as it is."""
    up = "../" * page.count("/")
    for text in list(doctree.findall(nodes.Text)):
        parts = _CASE.split(text.astext())
        if len(parts) > 1 and is_free(text) and not isinstance(text.parent, nodes.literal | nodes.literal_block):
            text.parent.replace(text, [_linked(part, up) for part in parts if part])


def _linked(part, up):
    if not _CASE.fullmatch(part):
        return nodes.Text(part)
    return nodes.reference("", part, internal=True, refuri=f"{up}{_REPORT}#{part.replace(' ', '-')}")
