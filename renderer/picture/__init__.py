"""Pictures: a scene packed for the kernels, its tiles rendered, the image and its files."""
