"""Settings that all tests share."""

import signal

from hypothesis import settings

from validation import timing

# The same examples on every machine; no deadline, because a first call compiles.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")

# No test judges a time that was measured, so none waits for other contenders' threads to come to rest.
timing.REST = 0.0

# A job in the background inherits SIGINT ignored, and would hand that on to the processes that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
