"""The same lumens by other programs: fast marching on the grey levels of 640 x 480 B-scans.

    python3 benches/peers/lumen.py  from anywhere; needs cargo and a network for PyPI

Has our benchmark write its images and their true areas and run, then gives each image to SimpleITK's fast marching and to
scikit-fmm, as they are used for this: a speed that falls with the gradient of the smoothed picture, a front from the
true centre, stopped where the threshold on its arrival that serves them best over all images is (which flatters
them: nobody knows the truth). Least of five runs an image; the mean error of the area.
Installs what it needs into target/peers.
"""

import csv
import os
import subprocess

from environment import ROOT, least, with_packages

NEEDS = ["numpy==2.4.6", "SimpleITK==2.5.7", "scikit-fmm==2025.6.23"]
FILES = ROOT / "target" / "bench-lumen"


def ours():
    environment = {**os.environ, "PROBEPATH_LUMEN_IMAGES": str(FILES)}
    command = ["cargo", "bench", "-p", "probepath-recon", "--bench", "lumen"]
    subprocess.run(command, cwd=ROOT, env=environment, check=True)


def images():
    import numpy as np

    rows = list(csv.reader((FILES / "truth.csv").open()))[1:]
    spacing = tuple(float(value) for value in rows.pop()[1:3])
    for name, area, column, row in rows:
        data = (FILES / name).read_bytes()
        pixels = np.frombuffer(data[-640 * 480:], dtype=np.uint8).reshape(480, 640)
        yield pixels, float(area), (int(float(column)), int(float(row))), spacing


def with_simpleitk(pixels, seed, spacing):
    import SimpleITK as sitk

    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    image = sitk.GetImageFromArray(pixels)
    image.SetSpacing(spacing)
    smooth = sitk.SmoothingRecursiveGaussian(sitk.Cast(image, sitk.sitkFloat32), 0.3)
    gradient = sitk.GradientMagnitudeRecursiveGaussian(smooth, 0.3)
    speed = sitk.Sigmoid(gradient, -8.0, 30.0, 1.0, 0.0)
    return sitk.GetArrayFromImage(sitk.FastMarching(speed, trialPoints=[seed], stoppingValue=100.0))


def with_scikit_fmm(pixels, seed, spacing):
    import numpy as np
    import skfmm

    level = np.ones(pixels.shape)
    level[seed[1], seed[0]] = -1.0
    smooth = pixels.astype(float)
    for axis in (0, 1):
        width = int(round(0.6 / spacing[1 - axis])) | 1
        kernel = np.ones(width) / width
        smooth = np.apply_along_axis(lambda line: np.convolve(line, kernel, "same"), axis, smooth)
    down, right = np.gradient(smooth, spacing[1], spacing[0])
    speed = 1.0 / (1.0 + np.exp((np.hypot(right, down) - 30.0) / 8.0)) + 1e-4
    arrival = skfmm.travel_time(level, speed, dx=(spacing[1], spacing[0]))
    return np.ma.filled(arrival, np.inf)


def judged(name, march):
    import numpy as np

    seconds, arrivals, areas, pixel = [], [], [], 0.0
    for pixels, area, seed, spacing in images():
        took, _, arrival = least(lambda: march(pixels, seed, spacing))
        seconds.append(took)
        arrivals.append(np.sort(np.asarray(arrival, dtype=float).ravel()))
        areas.append(area)
        pixel = spacing[0] * spacing[1]
    def errors(threshold):
        found = [np.searchsorted(arrival, threshold) * pixel for arrival in arrivals]
        return np.array(found) / np.array(areas) - 1.0
    # The threshold at which the fewest lumens are wrong, known only because the truth is.
    best = min(np.linspace(1.0, 60.0, 240), key=lambda threshold: np.mean(np.abs(errors(threshold))))
    off = errors(best)
    print(f"{name}: {1e3 * np.median(seconds):.1f} ms an image (median of images), area {100 * off.mean():+.1f} % mean, "
          f"{100 * np.abs(off).mean():.1f} % mean size of the error, worst {100 * np.abs(off).max():.0f} %")


if __name__ == "__main__":
    with_packages(NEEDS)
    ours()
    judged("SimpleITK fast marching, one thread", with_simpleitk)
    judged("scikit-fmm", with_scikit_fmm)
