r"""Times `polestar render` and Cycles on one picture of a filled solid, cut open, and writes a page about it.

    blender -b --factory-startup --python-exit-code 3 --python compare.py -- \
        POLESTAR FILLED.vdb SURFACE.obj TITLE PAGE.md

POLESTAR is the program; FILLED.vdb has `surface`, `density` and `color`; SURFACE.obj is what bench_cut_surface makes
of it; TITLE names the solid in the page. Both renderers run by turns, so that what else the machine does strikes
both alike.
"""

import array
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy

from scene import OPACITY, ColoredMesh, CyclesStage, View

WIDTH, HEIGHT, THREADS = 960, 720, 2
SAMPLES = (16, 32)  # polestar's
VOLUME_SAMPLES = 2  # of Cycles in a dense volume, whose shadows are marched through, too: minutes
REFERENCE_SAMPLES = {"polestar": 1024, "surface": 1024, "volume": 64}
CROP_SIZE = 96  # pixels, of the parts on which noise is measured
SHADOW_REACH = 2.5  # of the shadow's part, from below the solid's middle; 1 is the shadow of the middle
ROUNDS = 5


def log(text):
    print("bench: " + text, file=sys.stderr, flush=True)


def polestar(program, vdb, out, samples, crop=None):
    """The report of one run, and the seconds of the whole command."""
    command = [program, "render", vdb, "--cut", "x", "--size", "%dx%d" % (WIDTH, HEIGHT), "--samples", str(samples),
               "-j", str(THREADS), "-o", out, "--overwrite", "--no-aovs", "--json", "-q"]
    if crop:
        command += ["--crop", ",".join(map(str, crop))]
    start = time.perf_counter()
    report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    return report, time.perf_counter() - start


def colors(path):
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    values = array.array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return [v for i, v in enumerate(values) if i % 4 != 3]


def relative_rms(path, reference):
    """Root mean square of the differences, relative to the mean."""
    found, right = colors(path), colors(reference)
    if len(found) != len(right):
        raise RuntimeError("the pictures differ in size")
    square = sum((a - b)**2 for a, b in zip(found, right)) / len(right)
    return math.sqrt(square) / (sum(right) / len(right))


class Contest:
    def __init__(self, program, vdb, obj, folder):
        self.program, self.vdb, self.folder = program, vdb, folder
        polestar(program, vdb, self.file("view.exr"), 1)
        view = View(self.file("view.exr"), WIDTH, HEIGHT)
        self.solid = ColoredMesh(obj)
        self.stage = CyclesStage(vdb, self.solid, view, THREADS)
        low, high = self.solid.low, self.solid.high
        middle = [(a + b) / 2 for a, b in zip(low, high)]
        # Around the middle of the cut, far from its rim, and where the floor is in full and half shade.
        key = view.key()
        fall = SHADOW_REACH * (middle[2] - low[2]) / key[2]
        self.crops = {"cut": self.around(view, (high[0], middle[1], middle[2])),
                      "shadow": self.around(view, (middle[0] - fall * key[0], middle[1] - fall * key[1], low[2]))}

    @staticmethod
    def around(view, point):
        x, y = (int(v) for v in view.pixel_of(point))
        half = CROP_SIZE // 2
        return (x - half, y - half, x + half, y + half)

    def file(self, name):
        return os.path.join(self.folder, name)

    def noise(self, kind, samples, part="cut"):
        """Against a picture of many samples by the same renderer."""

        def draw(path, count, seed):
            if kind == "polestar":
                polestar(self.program, self.vdb, path, count, self.crops[part])
            else:
                self.stage.show(kind)
                self.stage.render(count, seed, path, self.crops[part])

        reference = self.file("%s_%s.exr" % (kind, part))
        if not os.path.exists(reference):
            draw(reference, REFERENCE_SAMPLES[kind], 1000)
        draw(self.file("noise.exr"), samples, 1)
        return relative_rms(self.file("noise.exr"), reference)

    def cycles_seconds(self, kind, samples, seed):
        self.stage.show(kind)
        start = time.perf_counter()
        self.stage.render(samples, seed)
        return time.perf_counter() - start

    def surfaces(self, samples):
        """By turns, with as many samples a pixel."""
        rows = {kind: {"samples": samples, "seconds": [], "noise": self.noise(kind, samples),
                       "shadow": self.noise(kind, samples, "shadow")} for kind in ("polestar", "surface")}
        own, other = rows["polestar"], rows["surface"]
        own["rays"], own["wall"] = [], []
        self.cycles_seconds("surface", 1, 0)  # builds the scene at this size
        for turn in range(ROUNDS):
            report, wall = polestar(self.program, self.vdb, self.file("p.exr"), samples)
            own["seconds"].append(report["rays"]["seconds"])
            own["rays"].append(report["rays"]["per_second"] * 1e-6)
            own["wall"].append(wall)
            other["seconds"].append(self.cycles_seconds("surface", samples, turn))
            log("round %d: %.2f s against %.2f s" % (turn + 1, own["seconds"][-1], other["seconds"][-1]))
        return own, other

    def dense_volume(self):
        """Once, beside polestar's fewest samples."""
        report, _ = polestar(self.program, self.vdb, self.file("p.exr"), SAMPLES[0])
        self.cycles_seconds("volume", 1, 0)  # builds the scene
        return {"noise": self.noise("volume", VOLUME_SAMPLES), "own_seconds": report["rays"]["seconds"],
                "seconds": self.cycles_seconds("volume", VOLUME_SAMPLES, 0)}


def machine():
    with open("/proc/cpuinfo") as file:
        names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    return "%s, %d threads" % (names[0] if names else "unknown processor", len(names))


def spread(values, form):
    return "%s (%s to %s)" % tuple(form % v for v in (statistics.median(values), min(values), max(values)))


PAGE = """# Rendering: polestar and Cycles side by side

This page is written by a script; no figure on it was typed. To make it anew (about ten minutes):

    tests/bench/cycles.sh

Measured on: %(machine)s. polestar %(version)s, Blender %(blender)s (Cycles on the CPU); both with %(threads)d
threads, by turns. Other programs used the machine at the same time: the ratios say more than the seconds.

The picture: %(title)s, %(width)d x %(height)d pixels, cut open,
with a soft key light, a dome and a floor; direct light only. Cycles got the key light in the same strength, size and
place, and an even dome of the strength of ours.

- *polestar* is `polestar render FILLED.vdb --cut x --size %(width)dx%(height)d --samples N -j %(threads)d`.
- *Cycles, surface* gets %(triangles)s triangles, already cut, with the colors at their vertices: shaders of surfaces
  cannot look into volumes, so somebody has to carry the colors over before. That and the building of the scene are not
  counted. Of polestar's, building the scene is not counted either; looking colors up in the grid is.
- *Cycles, dense volume* is the same .vdb as a Principled Volume, which needs no preparation, with an optical depth of
  %(opacity)g a voxel.

Noise is the root mean square difference to a picture of many more samples by the same renderer, relative to its mean,
on %(crop)d x %(crop)d pixels: *cut*, the middle of the cut, which sees all of the key light and most of the dome;
*shadow*, a part of the floor's shadow. Adaptive sampling and denoising are off.

## As many samples

%(rounds)d rounds; medians, and in parentheses the least and the most.

| renderer | samples | noise, cut | noise, shadow | seconds | million rays/s | seconds, Cycles / polestar |
|---|---|---|---|---|---|---|
%(rows)s

polestar's whole command, from start to written file: %(walls)s s.

## As little noise

Noise falls with the root of the number of samples, and time grows with it: seconds times noise squared are the price
of a picture. By the figures above with %(own_samples)d samples, Cycles / polestar is
on the cut %(cut_ratio).0f, in the shadow %(shadow_ratio).1f, for the surface.

As a check, the surface was given the %(matched_samples)d samples that follow for the cut: its noise there came out as
%(matched_noise).4f, polestar's is %(own_noise).4f. The dense volume was rendered once with %(volume_samples)d samples,
in %(volume_seconds).1f s beside %(volume_own).2f s for polestar, with a noise of %(volume_noise).2f.

On the cut polestar has next to no noise, since every sample asks both the key light and the dome, the latter by the
cosine; Cycles, as it comes, asks one of its lights a sample. In the shadow both trace rays to find out what is hidden,
and differ less.
"""


def equal_noise_ratio(own, other, part):
    """Of the times, if both had the samples that give one noise: that falls with the root of their number."""
    seconds = statistics.median(b / a for a, b in zip(own["seconds"], other["seconds"]))
    return seconds * (other[part] / own[part])**2


def page(contest, title, report, pairs, matched, volume):
    rows = []
    for own, other in pairs:
        ratios = [b / a for a, b in zip(own["seconds"], other["seconds"])]
        for name, row, rays, ratio in (("polestar", own, spread(own["rays"], "%.1f"), ""),
                                       ("Cycles, surface", other, "", spread(ratios, "%.1f"))):
            rows.append("| %s | %d | %.4f | %.4f | %s | %s | %s |" % (name, row["samples"], row["noise"], row["shadow"],
                                                                  spread(row["seconds"], "%.2f"), rays, ratio))
    own, other = pairs[0]
    return PAGE % {
        "machine": machine(), "version": report["version"], "blender": bpy.app.version_string, "threads": THREADS,
        "title": title, "width": WIDTH, "height": HEIGHT, "triangles": format(contest.solid.triangles, ","),
        "opacity": OPACITY, "crop": CROP_SIZE, "rounds": ROUNDS, "rows": "\n".join(rows),
        "walls": ", ".join("%.2f (%d samples)" % (statistics.median(a["wall"]), a["samples"]) for a, _ in pairs),
        "own_samples": own["samples"], "own_noise": own["noise"],
        "matched_samples": matched["samples"], "matched_noise": matched["noise"],
        "volume_samples": VOLUME_SAMPLES, "volume_noise": volume["noise"], "volume_seconds": volume["seconds"],
        "volume_own": volume["own_seconds"],
        "cut_ratio": equal_noise_ratio(own, other, "noise"), "shadow_ratio": equal_noise_ratio(own, other, "shadow"),
    }


def main():
    program, vdb, obj, title, path = sys.argv[sys.argv.index("--") + 1:]
    with tempfile.TemporaryDirectory() as folder:
        contest = Contest(program, vdb, obj, folder)
        report, _ = polestar(program, vdb, contest.file("p.exr"), 1)
        pairs = [contest.surfaces(samples) for samples in SAMPLES]
        own, other = pairs[0]
        samples = round(other["samples"] * (other["noise"] / own["noise"])**2)
        matched = {"samples": samples, "noise": contest.noise("surface", samples)}
        text = page(contest, title, report, pairs, matched, contest.dense_volume())
    with open(path, "w") as file:
        file.write(text)


if __name__ == "__main__":
    main()
