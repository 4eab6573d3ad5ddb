#!/usr/bin/env python3
"""A fulldome picture from cube faces: the elliptical filter against ffmpeg's v360 and ImageMagick's -distort.

README.md beside this file says what is compared. Needs Python 3 with NumPy; ffmpeg and ImageMagick 6 where installed.
"""

import argparse
import json
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]


def cpu_seconds(command):
    """User and system time of a command, its start included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def v360(faces, width, folder, out, loops=0):
    """ffmpeg's command from the faces' planes to a dome by lanczos, on one thread."""
    view = f"v360=c6x1:fisheye:in_forder=frblud:h_fov=180:v_fov=180:w={width}:h={width}:interp=lanczos"
    return ["ffmpeg", "-y", "-hide_banner", "-loglevel", "error", "-threads", "1", "-filter_threads", "1",
            "-stream_loop", str(loops), "-f", "rawvideo", "-pix_fmt", "gbrp", "-s", f"{6 * faces}x{faces}",
            "-i", str(folder / "faces.gbrp"), "-vf", view, *out]


def errors(picture, folder, width):
    """RMSE to both references and in what the picture cannot carry, in 255ths; shape of all: 3, width, width."""
    shape = (3, width, width)
    result = {}
    for name in ["box", "gauss"]:
        truth = np.fromfile(folder / f"{name}.f32", np.float32).reshape(shape)
        off = 255 * (picture - truth)
        result[name] = float(np.sqrt(np.nanmean(off**2)))
        if name == "gauss":
            mask = np.fromfile(folder / "alias.u8", np.uint8).reshape(shape) > 0
            above = off[mask]
            result["alias"] = float(np.sqrt(np.nanmean(above**2))) if mask.any() else float("nan")
    return result


def quality(bench, faces, width, profiles):
    print(f"\nFaces of {faces} to a dome of {width}, errors in 255ths\n")
    print("| | RMSE to box | RMSE to Gaussian | above 1.25 of what pixels carry |\n| --- | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([bench, "dome-files", str(faces), str(width), name], check=True)
        for profile in profiles:
            subprocess.run([bench, "dome-own", str(faces), str(width), profile, "1", name], check=True,
                           stdout=subprocess.DEVNULL)
            own = np.fromfile(folder / "own.f32", np.float32).reshape(3, width, width)
            row(f"ours, {profile}", errors(own, folder, width))
        told = subprocess.run([bench, "dome-two-pass", str(faces), str(width), name], check=True, capture_output=True,
                              text=True).stdout
        own = np.fromfile(folder / "own.f32", np.float32).reshape(3, width, width)
        row(f"two passes (bottleneck {json.loads(told)['bottleneck']})", errors(own, folder, width))
        if shutil.which("ffmpeg"):
            out = folder / "v360.gbrp"
            subprocess.run(v360(faces, width, folder, ["-f", "rawvideo", str(out)]), check=True)
            g, b, r = np.fromfile(out, np.uint8).reshape(3, width, width).astype(np.float32) / 255
            row("v360 lanczos", errors(np.stack([r, g, b]), folder, width))


def row(title, found):
    print(f"| {title} | {found['box']:.2f} | {found['gauss']:.2f} | {found['alias']:.2f} |", flush=True)


def speed(bench, faces, width, rounds):
    print(f"\nFaces of {faces} to a dome of {width}, CPU seconds of one thread, least of {rounds} rounds in turn\n")
    own, two_pass, first, both = [], [], [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Any bytes do for time; these need no rendering.
        noise = np.random.default_rng(1).integers(0, 256, 18 * faces * faces, np.uint8)
        noise.tofile(folder / "faces.gbrp")
        for _ in range(rounds):
            told = subprocess.run([bench, "dome-own", str(faces), str(width), "auto", "1", name], check=True,
                                  capture_output=True, text=True).stdout
            own.append(json.loads(told))
            told = subprocess.run([bench, "dome-two-pass", str(faces), str(width), name], check=True,
                                  capture_output=True, text=True).stdout
            two_pass.append(json.loads(told))
            if shutil.which("ffmpeg"):
                null = ["-f", "null", "-"]
                first.append(cpu_seconds(v360(faces, width, folder, null)))
                both.append(cpu_seconds(v360(faces, width, folder, null, loops=4)))
    best = {key: min(times[key] for times in own) for key in own[0]}
    frame = best["prepare"] + best["filter"]
    first_frame = best["map"] + best["first"] + best["filter"]
    print(f"ours: map {best['map']:.2f}, texels and aprons {best['first']:.2f} and {best['prepare']:.2f}, "
          f"filter {best['filter']:.2f}; first frame {first_frame:.2f}, further {frame:.2f}")
    map_time, filter_time = (min(times[key] for times in two_pass) for key in ["map", "filter"])
    print(f"two passes: map {map_time:.2f}, filter {filter_time:.2f}")
    if first:
        further = (min(both) - min(first)) / 4
        print(f"v360 lanczos, reading raw faces included: first frame {min(first):.2f}, further {further:.2f}; ours take "
              f"{first_frame / min(first):.2f} and {frame / further:.2f} of it")
    printed = float(subprocess.run([bench, "dome-printed", str(faces), str(width)], check=True, capture_output=True,
                                   text=True).stdout)
    print(f"the scan as printed: {printed:.2f}; ours is {printed / best['filter']:.1f} times as fast")
    if shutil.which("convert"):
        magick(width, width**2 / best["filter"] * 1e-6)


def magick(width, own):
    """ImageMagick has no cube maps: the upper half of a panorama to a disc, in its default EWA."""
    with tempfile.TemporaryDirectory() as name:
        panorama, out = str(Path(name) / "in.ppm"), str(Path(name) / "out.ppm")
        size = f"{2 * width}x{width // 2}"
        subprocess.run(["convert", "-size", size, "plasma:", "-depth", "8", panorama], check=True)
        with_files = ["convert", "-limit", "thread", "1", panorama, "-virtual-pixel", "HorizontalTile"]
        polar = ["-define", f"distort:viewport={width}x{width}", "-distort", "Polar", f"{width // 2}"]
        files = cpu_seconds(with_files + ["-depth", "8", out])
        time = cpu_seconds(with_files + polar + ["-depth", "8", out]) - files
        theirs = width**2 / time * 1e-6
        print(f"ImageMagick, Polar: {theirs:.1f} Mpx/s, ours {own:.1f}: {own / theirs:.1f} times as fast")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", choices=["quality", "speed"])
    parser.add_argument("--bench", help="the program veduta-bench, where it is built already")
    options = parser.parse_args()
    bench = options.bench
    if bench is None:
        subprocess.run(["cargo", "build", "--release", "-p", "veduta-bench"], cwd=ROOT, check=True)
        bench = str(ROOT / "target/release/veduta-bench")
    for program in ["ffmpeg", "convert"]:
        if not shutil.which(program):
            print(f"{program} is not installed; left out", file=sys.stderr)
    if options.only != "speed":
        quality(bench, 1024, 512, ["auto", "gaussian"])
        quality(bench, 512, 1024, ["auto", "sharp", "robidoux", "mitchell"])
    if options.only != "quality":
        speed(bench, 2048, 4096, options.rounds)


if __name__ == "__main__":
    main()
