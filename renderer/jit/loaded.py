"""The time at which this process loaded the package; a source newer on disk is not the one that runs."""

import time

# Seconds since the epoch, as files have them.
AT = time.time()
