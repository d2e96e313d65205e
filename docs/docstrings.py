"""This project's docstrings as reStructuredText: tables of names become lists of definitions, other text stays text."""

import re

# A row of such a table: a name or a few, two spaces or more or a colon, and what it is. Its further lines are indented.
ROW = re.compile(r"^(\S(?:\S| (?! ))*?)(?: {2,}| : )(\S.*)$")
LITERAL = re.compile(r"(``.*?``)")


def as_rst(lines: list[str]) -> None:
    """Rewrite the lines of a docstring in place."""
    written: list[str] = []
    in_row = in_example = False
    for line in lines:
        in_example = (in_example and bool(line.strip())) or line.lstrip().startswith(">>>")
        row = None if in_example else ROW.match(line)
        if row is not None:
            written += ["", _escaped(row[1]), "    " + _escaped(row[2])]
        elif in_row and line.startswith(" ") and not in_example:
            written.append("    " + _escaped(line.strip()))
        else:
            written += [""] * in_row + [line if in_example else _escaped(line)]
        in_row = row is not None or (in_row and line.startswith(" "))
    lines[:] = written


def _escaped(text: str) -> str:
    """What reStructuredText would take for marks, outside of literals, stands for itself."""
    parts = LITERAL.split(text)
    return "".join(
        part if k % 2 else re.sub(r"([|*`])|(?<=\w)(_)(?!\w)", r"\\\g<0>", part) for k, part in enumerate(parts)
    )
