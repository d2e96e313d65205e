"""Names of the public API in the text as links to its pages: `closest_hit` as `Octree.closest_hit`."""

from collections import defaultdict

from literal_links import free_literals, lead

# Names in the text that are commands or words as well.
_AMBIGUOUS = {"render", "view", "study"}
_KINDS = {"class", "function", "method"}


def link_api(app, doctree, page):
    """Make links of the literals of ``doctree`` that are the name of a class, function or method, with arguments or
    without, by its whole name or its end. Titles and what is a link already stay as they are.
    """
    targets = _targets(app.env.get_domain("py").objects)
    for literal in free_literals(doctree):
        target = targets.get(literal.astext().partition("(")[0])
        if target is not None:
            lead(literal, f"{app.builder.get_relative_uri(page, target.docname)}#{target.node_id}")


def _targets(objects):
    """The objects of the names: whole ones, and ends of them that one object has, or Octree and others."""
    found = defaultdict(set)
    for name, entry in objects.items():
        words = name.split(".")
        if entry.objtype in _KINDS:
            for first in range(len(words)):
                found[".".join(words[first:])].add(entry)
    for name, entries in found.items():
        if len(entries) > 1:
            found[name] = {entry for entry in entries if ".Octree." in entry.node_id}
    return {name: min(entries) for name, entries in found.items() if len(entries) == 1 and name not in _AMBIGUOUS}
