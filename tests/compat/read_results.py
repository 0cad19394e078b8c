#!/usr/bin/env python3
"""Reads a model and a depth map by their documented layout and prints some of them as JSON.

    read_results.py MODEL.ply DEPTH.pfm
"""
import json
import sys

import numpy as np

SURFEL = np.dtype([(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")]
                  + [(name, "u1") for name in ("red", "green", "blue")]
                  + [("radius", "<f4"), ("confidence", "<f4")])


def main(ply, pfm):
    with open(ply, "rb") as file:
        surfels = np.frombuffer(file.read().split(b"end_header\n", 1)[1], SURFEL)
    with open(pfm, "rb") as file:
        assert file.readline() == b"Pf\n"
        width, height = map(int, file.readline().split())
        assert float(file.readline()) < 0
        depth = np.frombuffer(file.read(), "<f4").reshape(height, width)[::-1]
    json.dump({"x": surfels["x"].tolist(), "red": surfels["red"].tolist(), "depth": depth.tolist()}, sys.stdout)


if __name__ == "__main__":
    main(*sys.argv[1:])
