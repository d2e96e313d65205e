"""The benchmark of ``make bench``: speed beside other systems, and error against run time."""
