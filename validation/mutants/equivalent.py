"""Mutants that change no answer, each with the proof in a sentence."""

# A mutant's key, see ``sites.Mutant.key``: why nobody can tell it from the sound renderer.
EQUIVALENT: dict[str, str] = {}
