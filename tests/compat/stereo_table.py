#!/usr/bin/env python3
"""Measures `mis-slam disparity` on pairs with known depth, beside OpenCV's SGBM on the same pixels.

    stereo_table.py MIS_SLAM DATA [--method sgm elas] [--set 30 32 d4d] [--every N] [--keep DIR]

DATA holds `bdis_synth/` and `d4d_clip/` (../shared/data). `bad>1` is the share of pixels more than one pixel off.
`common` counts the pixels that both our method and OpenCV match, `in all` those that all methods match, `own` all that a
method matches itself.
Coverage is of the pixels at which there is a surface; `visible` is the share of those that the right eye sees too.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

DISPARITIES = 256
FOCAL_BASELINE_SYNTH = 260.0
FOCAL_BASELINE_D4D = 2.608
# nothing is there: the renderer's far plane, in scene units
FAR_UNITS = 49.5
# Rows of the libraries, taken once over the pixels valid in all three of them: share off, coverage (%).
ANCHORS = {
    "30": [("ELAS library", 25.8, 49), ("OpenCV SGBM HH", 23.5, 57), ("Bayesian inverse search", 16.1, 63)],
    "32": [("ELAS library", 13.1, 83), ("OpenCV SGBM HH", 8.8, 87), ("Bayesian inverse search", 7.1, 85)],
}


def read_pfm(path):
    with open(path, "rb") as file:
        assert file.readline() == b"Pf\n"
        width, height = map(int, file.readline().split())
        assert float(file.readline()) < 0
        return np.frombuffer(file.read(), "<f4").reshape(height, width)[::-1].astype(np.float64)


def ours(arguments, left, right, method):
    with tempfile.TemporaryDirectory() as scratch:
        out = pathlib.Path(scratch) / "disparity.pfm"
        if arguments.keep:
            out = pathlib.Path(arguments.keep) / f"{left.parts[-3]}_{left.stem}_{method}.pfm"
            out.parent.mkdir(parents=True, exist_ok=True)
        command = [arguments.mis_slam, "disparity", left, right, "-o", out, "--method", method,
                   "--max-disparity", str(DISPARITIES - 1)]
        subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)
        return read_pfm(out)


def opencv(left, right):
    """SGBM with all eight directions; both images are widened so that the left border is searched too."""
    matcher = cv2.StereoSGBM_create(
        minDisparity=0, numDisparities=DISPARITIES, blockSize=5, P1=8 * 25, P2=32 * 25, disp12MaxDiff=1,
        preFilterCap=63, uniquenessRatio=10, speckleWindowSize=100, speckleRange=2, mode=cv2.STEREO_SGBM_MODE_HH)
    pair = [cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2GRAY) for path in (left, right)]
    wide = [cv2.copyMakeBorder(image, 0, 0, DISPARITIES, 0, cv2.BORDER_REPLICATE) for image in pair]
    found = matcher.compute(*wide)[:, DISPARITIES:] / 16.0
    return np.where(found > 0, found, np.inf)


def synthetic_truth(path):
    """Disparity, inf where there is no surface. Z = round(G * 100 / 255) + R / 255 scene units."""
    image = cv2.imread(str(path)).astype(np.float64)
    depth = np.round(image[:, :, 1] * 100 / 255) + image[:, :, 2] / 255
    with np.errstate(divide="ignore"):
        return np.where((depth > 0) & (depth < FAR_UNITS), FOCAL_BASELINE_SYNTH / depth, np.inf)


def synthetic_pairs(folder):
    depths = sorted((folder / "depth_rg").glob("*.png"))
    shift = 1 if depths[0].stem.endswith("_0000000") else 0
    for left in sorted((folder / "left").glob("*.png"), key=lambda path: int(path.stem)):
        depth = folder / "depth_rg" / f"depth_{int(left.stem) - shift:07d}.png"
        if depth.exists():
            yield left, folder / "right" / left.name, synthetic_truth(depth)


def seen_by_both(truth):
    """Pixels whose partner lies in the right image and is not hidden by something nearer."""
    rows, columns = np.indices(truth.shape)
    surface = np.isfinite(truth)
    partner = np.where(surface, np.round(columns - np.where(surface, truth, 0)), -1).astype(int)
    inside = partner >= 0
    nearest = np.zeros(truth.shape)
    np.maximum.at(nearest, (rows[inside], partner[inside]), truth[inside])
    seen = inside.copy()
    seen[inside] = nearest[rows[inside], partner[inside]] <= truth[inside] + 2
    return seen


def off(found, truth, where):
    """Per cent of the pixels `where` that are more than a pixel off; one at no surface is."""
    with np.errstate(invalid="ignore"):
        wrong = ~(np.abs(found - truth) <= 1)
    return 100 * wrong[where].mean() if where.any() else float("nan")


def synthetic_rows(arguments, left, right, truth):
    """One row of figures for each of our methods."""
    other = opencv(left, right)
    all_found = [ours(arguments, left, right, method) for method in arguments.method]
    surface = np.isfinite(truth)
    in_all = np.logical_and.reduce([np.isfinite(found) for found in [other, *all_found]])
    share = lambda where: 100 * where[surface].mean()

    def row(found):
        mine = np.isfinite(found)
        common = mine & np.isfinite(other)
        return [off(found, truth, common), off(other, truth, common), off(found, truth, in_all), off(other, truth, in_all),
                off(found, truth, mine), share(mine), 100 * mine.mean(), off(other, truth, np.isfinite(other)),
                share(np.isfinite(other)), share(seen_by_both(truth))]

    return [row(found) for found in all_found]


def synthetic(arguments, name):
    pairs = list(synthetic_pairs(arguments.data / "bdis_synth" / name))[:: arguments.every]
    print(f"\nbdis_synth/{name}, {len(pairs)} pairs (means over the pairs, per cent)")
    print(f"{'':27}bad>1 common{'in all':>9}{'own':>9}{'coverage':>12}{'of all pixels':>17}")
    for anchor, bad, coverage in ANCHORS.get(name, []):
        print(f"{anchor + ' (1)':27}{'':12}{bad:9.1f}{'-':>9}{coverage:12d}")
    figures = np.mean([synthetic_rows(arguments, *pair) for pair in pairs], axis=0)
    for method, row in zip(arguments.method, figures):
        common, theirs, in_all, theirs_in_all, own, covered, of_all, own_theirs, covered_theirs, visible = row
        print(f"{'OpenCV SGBM HH':27}{theirs:12.1f}{theirs_in_all:9.1f}{own_theirs:9.1f}{covered_theirs:12.1f}")
        print(f"{'ours, ' + method:27}{common:12.1f}{in_all:9.1f}{own:9.1f}{covered:12.1f}{of_all:17.1f}")
    print(f"{'visible in both eyes':27}{'':30}{visible:12.1f}")
    print("(1) published rows, over the pixels valid in all three libraries. `common`: over those valid in ours and in\n"
          "SGBM HH. `in all`: over those valid in SGBM HH and in each of our methods asked for, the nearest to (1).")


def d4d(arguments):
    folder = arguments.data / "d4d_clip"
    depths = sorted((folder / "depth16").iterdir())[:: arguments.every]
    print(f"\nd4d_clip, {len(depths)} pairs, outside masks and captions, against the authors' stereo estimate")
    for method in arguments.method:
        rows = []
        for path in depths:
            left, right, mask = (next((folder / kind).glob(path.stem + ".*")) for kind in ("left", "right", "mask"))
            theirs = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) / 1e5
            usable = (cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE) == 0) & (theirs > 0)
            usable[:45, :130] = False
            found = ours(arguments, left, right, method)
            both = usable & np.isfinite(found)
            error_mm = 1e3 * np.abs(FOCAL_BASELINE_D4D / found[both] - theirs[both])
            rows.append([np.median(error_mm), 100 * both.sum() / usable.sum()])
        error_mm, coverage = np.mean(rows, axis=0)
        print(f"ours, {method}: median |Z - theirs| {error_mm:.2f} mm, coverage {coverage:.1f} %")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mis_slam")
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--method", nargs="+", default=["sgm"])
    parser.add_argument("--set", nargs="+", default=["30", "32", "d4d"])
    parser.add_argument("--every", type=int, default=1, help="take each N-th pair only")
    parser.add_argument("--keep", help="folder for the disparity images")
    arguments = parser.parse_args()
    for name in arguments.set:
        d4d(arguments) if name == "d4d" else synthetic(arguments, name)
    sys.stdout.flush()


if __name__ == "__main__":
    main()
