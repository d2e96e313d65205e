"""Speed beside other systems, and error against run time: what `make bench` measures."""
