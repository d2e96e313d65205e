"""Inputs at the ends of what there is: each gives one clear error or a sound result.

Kinds; a seed and a number make the same input each time:

files       mutated mesh and scene files (ascii.ply ... scene.toml), files.py
camera, light, transform, settings    scenes at the ends of numbers, scenes.py
query       rays at the ends of numbers, of odd shapes and types, rays.py
output      files that cannot be written, faults.py

The long run, with its findings kept as files, and one input of it again:

    python tests/fuzz --inputs 100000 --seed 1 [--kinds ascii.ply camera] [--keep folder]
    python tests/fuzz --inputs 1 --first 4711 --kinds camera
"""
