"""``octree-validate --record`` and ``--compare``: whether a changed mesh is hit as it was before."""
