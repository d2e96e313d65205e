"""View factors: which share of what leaves one surface arrives at another."""
