"""The page docs/bench-morph.md from the answers of `polestar morph --json` and of bench_morph_peers.

page.py OUT.md FROM.ply TO.ply DIM STRAIGHT.json RADIAL.json PEERS.json
"""
import json
import sys

out, first, last, dim, *files = sys.argv[1:]
straight, radial, peers = (json.load(open(name)) for name in files)


def ours(answer, name):
    timings = answer["timings"]
    frames = answer["frames"]
    each = sum(timings.get(part, 0) for part in ("pose", "prove", "grids", "filter", "judge")) / len(frames)
    return {
        "name": name,
        "volumes": [frame["volume"] for frame in frames],
        "seconds_a_frame": each,
        "refused": sum(not frame["proof"]["holds"] for frame in frames),
        "mended": max(frame["mended"]["nodes"] for frame in frames),
        "deep": sum(frame["voxel_cells"]["inverted_deep"] for frame in frames),
    }


rows = [ours(straight, "`--path straight`"), ours(radial, "`--path radial`"), *peers]
count = len(rows[0]["volumes"])
shown = sorted({round(i * (count - 1) / 8) for i in range(9)})
unit = rows[0]["volumes"][0]
text = [
    "# Morphing, measured",
    "",
    f"{first} turns into {last} in {count} frames, {dim} voxels along the box around both; by `tests/bench/morph.sh` on one machine whose",
    "processors others used, too. Volumes are shares of the first shape's.",
    "",
    "| | " + " | ".join(f"frame {i + 1}" for i in shown) + " | seconds a frame |",
    "|---|" + "---|" * (len(shown) + 1),
]
for row in rows:
    cells = [f"{row['volumes'][i] / unit:.3f}" for i in shown]
    text.append(f"| {row['name']} | " + " | ".join(cells) + f" | {row['seconds_a_frame']:.2f} |")
text += [
    "",
    "Ours have an inside: ball coordinates, velocities, every tetrahedron judged. Seconds are those of grids that are computed and judged,",
    "without writing; the others' are those of a level set alone, which knows neither where a point came from nor how fast it moves.",
    "The surface of `straight` is what linear interpolation of the shared triangles gives without an inside.",
    "",
]
for row in rows[:2]:
    text.append(f"- {row['name']}: {row['refused']} frames refused, {row['mended']} nodes mended at most in a frame, "
                f"{row['deep']} inverted cells between voxels deeper than one, all frames together.")
time_needed = peers[0]["time_needed"]
text.append(f"- LevelSetMorphing has no end of its own: it was run to time {time_needed:g}, where its volume is within 0.1 % of the target's"
            " or after six doublings.")
open(out, "w").write("\n".join(text) + "\n")
