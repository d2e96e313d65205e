"""Looking into a picture: one ray's path, the tree's boxes, one colour per face, false colours."""
