"""Settings that all tests share."""

from hypothesis import settings

# The same examples on every machine; no deadline, because a first call compiles.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")
