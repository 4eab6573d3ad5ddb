#!/usr/bin/env python3
"""Composites of two programs' pictures: stored maps against deep OpenEXR merged by OpenImageIO.

README.md beside this file says what is compared. Needs Python 3 and oiiotool.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAIRS = ["cross", "split", "dense"]
# CPU time of theirs over ours, and size of their merged file over the seen half of ours, at least.
BARS = {"time": 12, "size": 8}
# Tables of what is seen; the others would be of what casts shadows unseen, and of other programs.
SEEN = ["points", "vertices", "faces", "opaque", "veils", "objects", "images"]


def say(*words):
    print(*words, file=sys.stderr, flush=True)


def output_of(command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def cpu_seconds(command):
    """User and system time of a command, its start included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def seen_bytes(path):
    """Bytes of a stored map that tell what is seen: its tables and the manifest."""
    members = {f"{table}.arrow" for table in SEEN} | {"manifest.json"}
    with zipfile.ZipFile(path) as archive:
        return sum(info.file_size for info in archive.infolist() if info.filename in members)


def table(titles, rows):
    print("| " + " | ".join(titles) + " |")
    print("| --- |" + " ---: |" * (len(titles) - 1))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print(flush=True)


def verdict(value, bar):
    return f"{value:.1f} ({'met' if value >= bar else 'MISSED'})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pairs", nargs="*", help=f"of {', '.join(PAIRS)}; default: all")
    parser.add_argument("--samples", type=int, default=8, help="samples along a pixel's side (default 8)")
    parser.add_argument("--rounds", type=int, default=3, help="turns of timing (default 3)")
    parser.add_argument("--keep", type=Path, help="a folder in which the files are left")
    arguments = parser.parse_args()
    unknown = set(arguments.pairs) - set(PAIRS)
    if unknown:
        parser.error(f"no such pairs: {', '.join(sorted(unknown))}; there are {', '.join(PAIRS)}")
    if shutil.which("oiiotool") is None:
        say("SKIPPED: oiiotool is not installed (Debian and Ubuntu: openimageio-tools)")
        return 1

    build = ["cargo", "build", "--release", "--quiet", "-p", "veduta-bench", "-p", "veduta-cli"]
    subprocess.run(build, cwd=ROOT, check=True)
    metadata = json.loads(output_of(["cargo", "metadata", "--format-version=1", "--no-deps",
                                     "--manifest-path", ROOT / "Cargo.toml"]))
    programs = Path(metadata["target_directory"]) / "release"
    bench, veduta = programs / "veduta-bench", programs / "veduta"
    print(f"OpenImageIO {output_of(['oiiotool', '--version']).strip()}, "
          f"{arguments.samples * arguments.samples} samples a pixel\n")

    times, errors, sizes = [], [], []
    for pair in arguments.pairs or PAIRS:
        with tempfile.TemporaryDirectory() as temporary:
            folder = arguments.keep / pair if arguments.keep else Path(temporary)
            folder.mkdir(parents=True, exist_ok=True)
            say(pair)
            told = json.loads(output_of([bench, "deep", pair, str(arguments.samples), folder]))
            files = {name: folder / name for name in os.listdir(folder)}
            theirs, ours = folder / "theirs.exr", folder / "ours.exr"
            # Both write half floats, compressed alike, with one thread.
            merge = ["oiiotool", "--threads", "1", files["a.exr"], files["b.exr"], "--deepmerge"]
            commands = {
                "theirs": [*merge, "--flatten", "-d", "half", "--compression", "zip", "-o", theirs],
                "ours": [veduta, "composite", files["a.veduta"], files["b.veduta"], "--unlit",
                         "--threads", "1", "--depth", "half", "-o", ours],
                "to a map": [veduta, "composite", files["a.veduta"], files["b.veduta"], "--force",
                             "--threads", "1", "-o", folder / "merged.veduta"],
            }
            least = {}
            for _ in range(arguments.rounds):
                for name, command in commands.items():
                    least[name] = min(cpu_seconds(command), least.get(name, float("inf")))
            output_of([*merge, "-o", folder / "merged.exr"])
            ratio = least["theirs"] / least["ours"]
            times.append([pair, f"{told['faces']}", f"{told['deepSamples']}",
                          *(f"{least[name]:.2f}" for name in ("theirs", "ours", "to a map")),
                          verdict(ratio, BARS["time"])])
            for name, picture in (("theirs", theirs), ("ours", ours)):
                off = json.loads(output_of([bench, "difference", files["both.exr"], picture]))
                shares = [f"{100 * off[over]:.3f} %" for over in ("over1", "over2", "over16")]
                errors.append([f"{pair}, {name}", *shares, f"{off['largest']:.5f}"])
            size = {name: (folder / name).stat().st_size
                    for name in ("a.exr", "b.exr", "merged.exr", "a.veduta", "b.veduta")}
            seen = seen_bytes(folder / "merged.veduta")
            megabytes = [f"{size[name] / 1e6:.2f}" for name in size]
            sizes.append([pair, *megabytes, f"{seen / 1e6:.2f}",
                          verdict(size["merged.exr"] / seen, BARS["size"])])

    print("CPU seconds from files to a picture, and to a map\n")
    table(["scenes", "faces", "deep samples", "deepmerge, flatten", "Veduta", "to .veduta",
           f"ratio (bar {BARS['time']})"], times)
    print("Pixels off the exact picture of both scenes by more than 1, 2 and 16 of 255\n")
    table(["scenes", "> 1", "> 2", "> 16", "largest"], errors)
    print("MB\n")
    table(["scenes", "deep A", "deep B", "merged", "map A", "map B", "merged", f"ratio (bar {BARS['size']})"],
          sizes)
    return 0


if __name__ == "__main__":
    sys.exit(main())
