#!/usr/bin/env python3
"""Veduta against other programs, in one run: CPU seconds of one thread to a picture of equal error.

Every program draws the same triangles in the same flat colours of linear light before the same
camera. The error is against our exact picture; that the others come ever closer to it with more
samples, and share no code with it, is the proof that it is right (table "Proof").

For each scene and rival the least n is sought at which n x n samples a pixel reach a largest error
of 4/255 and a root mean square error (RMSE) of 1/255; then rival and Veduta take turns being timed.
A rival that is not installed is skipped aloud. See README.md.
"""

import argparse
import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SIZE = (512, 512)
SCENES = [
    "radial", "mesh0", "mesh5", "bridge", "buildings", "pierce", "balls3", "balls7",
    "field100k", "field1m",
]
DEPTH_CASES = [
    "balls7@1920x1080", "field1m@1920x1080", "leaves100@1920x1080", "field10m@1920x1080",
]

# What Veduta holds itself to against llvmpipe, times as fast at equal error. The field: with loading.
BARS = {
    "max": {"radial": 50, "bridge": 50, "buildings": 50, "pierce": 50, "balls3": 40, "balls7": 40,
            "field1m": 3},
    "rmse": {"radial": 10, "mesh0": 10, "mesh5": 10, "buildings": 2, "pierce": 2, "balls3": 2,
             "balls7": 2},
}
WITH_LOADING = {"field100k", "field1m"}
GOALS = {"max": 4.0, "rmse": 1.0}  # in 1/255 of linear light
PROVED = 0.1  # an RMSE in 1/255 that only an equal picture has

LADDER = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256]
# Which is best depends on how much of a tile's cost is its vertices; each is tried.
TILES = [512, 1024, 2048, 4096]


@dataclass
class Rival:
    name: str
    source: str
    compiler: list
    libraries: list
    packages: str
    has_tiles: bool = False
    program: Path = None


RIVALS = [
    Rival("llvmpipe", "llvmpipe.c", ["cc"], ["-lEGL", "-lOpenGL"],
          "libegl-dev libopengl-dev libgl1-mesa-dri", has_tiles=True),
    Rival("embree", "embree.cpp", ["c++"], ["-lembree3"], "libembree-dev"),
]


def say(*words):
    print(*words, file=sys.stderr, flush=True)


def output_of(command):
    """What a command writes, or an exception that shows why there is nothing."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(str(word) for word in command)}: {done.stderr.strip()}")
    return done.stdout


def compiled(folder):
    """The rivals that can be had."""
    found = []
    for rival in RIVALS:
        program = folder / rival.name
        try:
            output_of([*rival.compiler, "-O3", "-march=native", HERE / rival.source, "-o", program,
                       *rival.libraries])
        except (RuntimeError, OSError) as error:
            say(f"SKIPPED: {rival.name} cannot be compiled; are {rival.packages} installed?\n{error}")
            continue
        rival.program = program
        found.append(rival)
    return found


@dataclass
class Sampled:
    """Pictures of one scene that a rival has made."""
    rival: Rival
    scene: Path
    exact: numpy.ndarray
    tile: int = None
    errors: dict = field(default_factory=dict)  # n -> {"max", "rmse"}
    times: dict = field(default_factory=dict)  # n -> least seconds of rendering
    load: float = math.inf

    def draw(self, n, *options, folder):
        picture = folder / f"{self.rival.name}.npy"
        tile = ["--tile", self.tile] if self.tile else []
        line = output_of([self.rival.program, self.scene, *SIZE, n, *tile, *options,
                          "--picture", picture])
        return json.loads(line), error_between(self.exact, numpy.load(picture))

    def measure(self, n, folder):
        times, error = self.draw(n, folder=folder)
        self.errors[n] = error
        self.times[n] = min(self.times.get(n, math.inf), times["render"])
        self.load = min(self.load, times["load"])

    def choose_tile(self, folder):
        if not self.rival.has_tiles:
            return
        seconds = {}
        for tile in TILES:
            self.tile = tile
            seconds[tile] = min(self.draw(16, folder=folder)[0]["render"] for _ in range(2))
        self.tile = min(seconds, key=seconds.get)

    def least_n(self, goal, patience, folder):
        """The least n that reaches a goal; whether that is only extrapolated."""
        reached = lambda n: self.errors[n][goal] <= GOALS[goal]
        failed = 0
        for n in LADDER:
            if n not in self.errors:
                if self.expected(n) > patience and len(self.errors) >= 4:
                    return self.extrapolated(goal), True
                self.measure(n, folder)
            if reached(n):
                break
            failed = n
        else:
            return self.extrapolated(goal), True
        # Any n in between that reaches the goal will do; errors of regular grids go up and down.
        while n - failed > max(1, n // 20):
            middle = (n + failed) // 2
            if middle not in self.errors:
                self.measure(middle, folder)
            if reached(middle):
                n = middle
            else:
                failed = middle
        return n, False

    def extrapolated(self, goal):
        """n at the power law through the last errors; never less than the largest n that failed."""
        last = sorted(self.errors)[-4:]
        x = numpy.log([float(n) for n in last])
        y = numpy.log([self.errors[n][goal] for n in last])
        slope, intercept = numpy.polyfit(x, y, 1)
        if slope >= -0.1:
            return math.inf
        return max(last[-1], math.exp((math.log(GOALS[goal]) - intercept) / slope))

    def expected(self, n):
        """CPU seconds with n x n samples, in proportion to the largest n that was run."""
        if not self.times:
            return 0.0
        largest = max(self.times)
        return self.times[largest] * (n / largest) ** 2

    def seconds(self, n):
        return self.times[n] if n in self.times else self.expected(n)


def error_between(exact, picture):
    """In 1/255 of linear light, over all pixels and channels."""
    difference = 255.0 * (picture[..., :3].astype(float) - exact)
    return {"max": float(abs(difference).max()), "rmse": float((difference**2).mean() ** 0.5)}


def table(titles, rows):
    print("| " + " | ".join(titles) + " |")
    print("| --- |" + " ---: |" * (len(titles) - 1))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print(flush=True)


def ms(seconds):
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


class Own:
    """Our own least times over all rounds."""

    def __init__(self, bench, title, scene, picture):
        self.command = [bench, "own", title, scene, picture]
        self.least = {}

    def measure(self):
        for name, value in json.loads(output_of(self.command)).items():
            self.least[name] = min(value, self.least.get(name, math.inf))
        # The parts may have had their best moments in different rounds; the sum is theirs.
        self.least["render"] = sum(self.least[part] for part in ("project", "map", "pixels"))


def loaded(own):
    """Our seconds from the file to the picture."""
    return own.least["load"] + own.least["render"]


def proof(sampled, patience, folder):
    """The smallest RMSE that many samples in floats come to."""
    options = ["--half"] if sampled.rival.has_tiles else []
    best = (math.inf, 0)
    for n in (16, 32, 64, 128):
        if best[0] < PROVED or (n > 16 and sampled.expected(n) > 2 * patience):
            break
        best = min(best, (sampled.draw(n, *options, folder=folder)[1]["rmse"], n))
    return best


def compare(bench, rivals, names, rounds, patience, folder):
    goal_rows = {goal: [] for goal in GOALS}
    proof_rows, own_rows = [], []
    for name in names:
        title = f"{name}@{SIZE[0]}x{SIZE[1]}"
        say(title)
        scene, exact_file = folder / "scene.bin", folder / "exact.npy"
        output_of([bench, "export", title, scene])
        output_of([bench, "reference", title, exact_file])
        exact = numpy.load(exact_file)[..., :3].astype(float)
        own = Own(bench, title, scene, folder / "own.npy")
        own.measure()
        own_error = error_between(exact, numpy.load(folder / "own.npy"))
        proof_row = [name, f"{own_error['max']:.5f}"]

        if own_error["max"] > PROVED:
            raise RuntimeError(f"{title}: our picture is off by {own_error['max']}/255")
        sampled, wanted = {}, {}
        for rival in rivals:
            made = Sampled(rival, scene, exact)
            made.choose_tile(folder)
            sampled[rival.name] = made
            for goal in GOALS:
                wanted[rival.name, goal] = made.least_n(goal, patience, folder)
            rmse, n = proof(made, patience, folder)
            proof_row.append(f"{rmse:.3f} ({n * n})" + ("" if rmse < PROVED else " not yet equal"))
        proof_rows.append(proof_row)

        ours = [own]
        if name in WITH_LOADING:
            model = folder / "scene.glb"
            output_of([bench, "export", title, model])
            ours.append(Own(bench, title, model, folder / "own.npy"))
        for _ in range(rounds):
            for one in ours:
                one.measure()
            for rival in rivals:
                made = sampled[rival.name]
                for n in {wanted[rival.name, goal][0] for goal in GOALS}:
                    if n in made.times and made.times[n] < patience:
                        made.measure(n, folder)

        parts = [own.least[part] for part in ("load", "project", "map", "pixels")]
        glb = ms(ours[1].least["load"]) if len(ours) > 1 else ""
        loads = [ms(sampled[rival.name].load) for rival in rivals]
        own_rows.append([name, f"{own.least['faces']}", *(ms(part) for part in parts), glb, *loads])
        for goal in GOALS:
            rows = [(name, own.least["render"], False)]
            if name in WITH_LOADING:
                rows = [(f"{name}, with loading", loaded(own), True),
                        (f"{name}, ours from GLB", loaded(ours[1]), True)]
            for label, seconds, with_loading in rows:
                row = [label, ms(seconds)]
                # A scene that may be loaded is held to its bar with loading.
                bar = None if with_loading != (name in WITH_LOADING) else BARS[goal].get(name)
                for rival in rivals:
                    made = sampled[rival.name]
                    n, guessed = wanted[rival.name, goal]
                    theirs = math.inf
                    if not math.isinf(n):
                        theirs = made.seconds(n) + (made.load if with_loading else 0)
                    mark = "~" if guessed else ""
                    row += [f"{mark}{ms(theirs)}", f"{mark}{n * n:.0f}", f"{mark}{theirs / seconds:.1f}"]
                    if rival.name == "llvmpipe":
                        verdict = "" if bar is None else (
                            f"{bar} met" if theirs / seconds >= bar else f"{bar} MISSED")
                if any(rival.name == "llvmpipe" for rival in rivals):
                    row.append(verdict)
                goal_rows[goal].append(row)
                say("  ", goal, *row)

    titles = ["scene, CPU ms", "Veduta"]
    for rival in rivals:
        titles += [rival.name, "samples", f"{rival.name} / Veduta"]
    if any(rival.name == "llvmpipe" for rival in rivals):
        titles.append("bar (llvmpipe)")
    for goal, unit in (("max", "largest error 4/255"), ("rmse", "RMSE 1/255")):
        print(f"To {unit}, 512x512\n")
        table(titles, goal_rows[goal])
    print("Where our time goes, and what loading takes\n")
    table(["scene, CPU ms", "faces in view", "load", "project", "map", "pixels", "load from GLB",
           *(f"{rival.name} load" for rival in rivals)], own_rows)
    print("Proof: RMSE to the exact picture with many samples (samples), in 1/255; ours: largest error\n")
    table(["scene", "Veduta", *(rival.name for rival in rivals)], proof_rows)


def depth_buffers(bench, llvmpipe, cases, rounds, folder):
    rows = []
    for title in cases:
        say(title)
        scene = folder / "scene.bin"
        output_of([bench, "export", title, scene])
        size = title.split("@")[1].split("x")
        own = Own(bench, title, scene, folder / "own.npy")
        mesa, depth = math.inf, math.inf
        for _ in range(rounds):
            own.measure()
            draw = [llvmpipe.program, scene, *size, 0, "--tile", 4096]
            mesa = min(mesa, json.loads(output_of(draw))["render"])
            depth = min(depth, json.loads(output_of([*draw, "--no-color"]))["render"])
        least = own.least
        through = least["project"] + least["map"]
        rows.append([
            title, f"{least['faces']}", ms(depth), ms(mesa), ms(least["zbuffer"]), ms(least["project"]),
            ms(least["map"]), f"{least['map'] / mesa:.1f}", f"{through / mesa:.1f}",
            f"{least['map'] / least['zbuffer']:.1f}",
        ])
        say("  ", *rows[-1])
    print("Our map against depth buffers of one sample a pixel (Mesa's times include its projection)\n")
    table(["scene, CPU ms", "faces in view", "llvmpipe depth", "with colours", "our z-buffer",
           "project", "map", "map / llvmpipe", "project + map / llvmpipe", "map / our z-buffer"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", help="scenes of the comparison; default: all")
    parser.add_argument("--rounds", type=int, default=3, help="turns of timing (default 3)")
    parser.add_argument("--patience", type=float, default=6.0,
                        help="CPU seconds a rival's picture may take before it is extrapolated (~)")
    parser.add_argument("--only", choices=["errors", "depth"], help="one half of the run")
    parser.add_argument("--depth-scenes", nargs="*", default=DEPTH_CASES)
    arguments = parser.parse_args()
    unknown = set(arguments.scenes) - set(SCENES)
    if unknown:
        parser.error(f"no such scenes: {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")

    subprocess.run(["cargo", "build", "--release", "--quiet", "-p", "veduta-bench"], cwd=ROOT, check=True)
    metadata = json.loads(output_of(["cargo", "metadata", "--format-version=1", "--no-deps",
                                     "--manifest-path", ROOT / "Cargo.toml"]))
    bench = Path(metadata["target_directory"]) / "release" / "veduta-bench"
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        rivals = compiled(folder)
        if not rivals:
            say("no rival can be had: there is nothing to compare with")
            return 1
        if arguments.only != "depth":
            compare(bench, rivals, arguments.scenes or SCENES, arguments.rounds, arguments.patience,
                    folder)
        llvmpipe = next((rival for rival in rivals if rival.name == "llvmpipe"), None)
        if arguments.only != "errors":
            if llvmpipe:
                depth_buffers(bench, llvmpipe, arguments.depth_scenes, arguments.rounds, folder)
            else:
                say("SKIPPED: depth buffers, for want of llvmpipe")
    return 0


if __name__ == "__main__":
    sys.exit(main())
