"""Studies as runs: points chosen on a mesh, parts kept on disk until all are done, results as arrays and pictures."""
