"""Studies of light and visibility: closed forms, every bit of occlusion against Embree, and what holds exactly."""
