"""Diagnostics of pictures and trees: paths of rays, boxes, false colours."""
