"""Entry point of a process in a workshop: the gates of some groups of checks, until the first red one."""

import json

# Prefix of the one line of results.
MARK = "red: "


def answer(task: str) -> None:
    """Print the first red gate of the groups in ``task``, a list as JSON; or null."""
    # Imported only now, so that what fails in it is an error of this call.
    from validation.defects.answer import name_of
    from validation.defects.checks import one_by_one

    red = next((name_of(gate) for gate in one_by_one(tuple(json.loads(task))) if not gate.passed), None)
    print(f"\n{MARK}{json.dumps(red)}")  # on a line of its own, whatever was printed before
