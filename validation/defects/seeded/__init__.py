"""The seeded defects, a module for each group of checks that runs against them."""
