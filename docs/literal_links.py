"""The common part of the modules that make links of words in the text."""

from docutils import nodes


def is_free(node):
    """Whether ``node`` stands in no link and in no title."""
    while node is not None and not isinstance(node, nodes.reference | nodes.title):
        node = node.parent
    return node is None


def free_literals(doctree):
    """The literals of ``doctree`` that may become links; a list, for they are replaced on the way."""
    return [literal for literal in doctree.findall(nodes.literal) if is_free(literal)]


def lead(literal, address):
    """Make a link to ``address`` of a literal, where it stands."""
    link = nodes.reference("", "", internal=True, refuri=address)
    literal.replace_self(link)
    link += literal
