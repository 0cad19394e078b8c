#!/usr/bin/env python3
"""Compares what stereo matching costs with OpenCV's StereoSGBM 3WAY, on one thread, in the same run.

    stereo_speed.py DISPARITY_SPEED LEFT RIGHT [--max-disparity N] [--frames N]

DISPARITY_SPEED is built by `cargo build -p tests --bin disparity_speed`. CPU time is user and system time of all
threads. OpenCV is measured before and after each of ours; the ratio is taken with the mean of the two.
"""
import argparse
import json
import subprocess
import time

import cv2

METHODS = {
    "default": [],
    "profile realtime": ["--profile", "realtime"],
    "profile cpu": ["--profile", "cpu"],
    "ELAS": ["--elas"],
}


def opencv_cpu_ms(arguments):
    """Of one pair, by as many disparities; both images are in memory."""
    left, right = (cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in (arguments.left, arguments.right))
    matcher = cv2.StereoSGBM_create(
        minDisparity=0, numDisparities=arguments.max_disparity + 1, blockSize=5, P1=8 * 25, P2=32 * 25, disp12MaxDiff=1,
        preFilterCap=63, uniquenessRatio=10, speckleWindowSize=100, speckleRange=2, mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY)
    matcher.compute(left, right)
    start = time.process_time()
    for _ in range(arguments.frames):
        matcher.compute(left, right)
    return 1e3 * (time.process_time() - start) / arguments.frames


def ours(arguments, options):
    command = [arguments.disparity_speed, arguments.left, arguments.right, "--frames", str(arguments.frames),
               "--max-disparity", str(arguments.max_disparity), *options]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("disparity_speed")
    parser.add_argument("left")
    parser.add_argument("right")
    parser.add_argument("--max-disparity", type=int, default=95, help="one less than a multiple of 16")
    parser.add_argument("--frames", type=int, default=10)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"{'':18}{'CPU ms':>8}{'SGBM 3WAY':>11}{'ratio':>7}{'wall ms':>9}{'GPU ms':>8}{'dispatches':>12}")
    for name, options in METHODS.items():
        before = opencv_cpu_ms(arguments)
        found = ours(arguments, options)
        peer = (before + opencv_cpu_ms(arguments)) / 2
        gpu_ms = sum(found["stages_ms"].values())
        print(f"{name:18}{found['cpu_ms']:8.1f}{peer:11.1f}{found['cpu_ms'] / peer:7.2f}{found['wall_ms']:9.1f}"
              f"{gpu_ms:8.1f}{found['dispatches']:12d}")
        stages = sorted(found["stages_ms"].items(), key=lambda stage: -stage[1])
        print("    " + ", ".join(f"{stage} {ms:.1f}" for stage, ms in stages))


if __name__ == "__main__":
    main()
