"""When this process loaded the package: what is newer on disk is not what it runs."""

import time

# Seconds since the epoch, as files have them.
AT = time.time()
