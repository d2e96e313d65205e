"""What shows how a picture and a tree come about: paths of rays, boxes, false colours."""
