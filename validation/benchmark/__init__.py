"""The benchmark of ``make bench``: speed beside other systems."""
