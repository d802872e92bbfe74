"""Real clouds of other people, where the folder is at hand: no truth, so counts, confidence and fit."""

import itertools
import shutil
import statistics

import laspy

from . import score

TETRAPOD = '[[block]]\nname = "tetrapod"\nshape = {{ kind = "tetrapod", size = {} }}\n'
CUBE = '[[block]]\nname = "cube"\nshape = {{ kind = "cube", size = {} }}\n'


# The 90° elbow of the scans; Pipe_01 and Pipe_03 are other fittings.
PIPE = '[[block]]\nname = "pipe"\nmesh = "Pipe_02.stl"\nunit = "mm"\ndensity_kg_m3 = 1400.0\n'


def without_crs(cloud, folder):
    """A copy that names no coordinate system: lone-star.laz calls its metres degrees, and is refused for it."""
    copy = folder / cloud.name
    if not copy.is_file():
        points = laspy.read(cloud)
        points.header.vlrs.clear()
        points.write(copy)
    return copy


def cases(data, folder):
    """Name, clouds, catalogue, what should come out, further options."""
    singles = sorted((data / "ajaccio_tetrapods").glob("*.laz"))
    for cloud in singles:
        yield cloud.stem, [cloud], TETRAPOD.format(2.86), "at least 1, fit below 20 mm", []
    # Files of one first number lie beside each other; those of different ones reach into each other (a quarter of the
    # points of 5_8 lie inside the block of 3_4): all joined are no pile that can be.
    for number, files in itertools.groupby(singles, lambda f: f.stem.split("_")[1]):
        if len(files := list(files)) > 1:
            want = f"{len(files)}, fit below 20 mm"
            yield f"tetrapods {number}_* joined", files, TETRAPOD.format(2.86), want, []
    if singles:
        yield "tetrapods joined", singles, TETRAPOD.format(2.86), "at least 5, fit below 20 mm", []
        for size in (1.6, 2.0, 2.4, 3.2):
            yield f"tetrapods joined, {size} m stated", singles, TETRAPOD.format(size), "none at .5 or more", []
    for name, file, entry in [
        ("trees, tetrapod 2 m", "lidar/lone-star.laz", TETRAPOD.format(2.0)),
        ("trees, cube 2 m", "lidar/lone-star.laz", CUBE.format(2.0)),
        ("boulders, cube 0.5 m", "rocks/Otira_1cm_grains.ply", CUBE.format(0.5)),
        ("boulders, tetrapod 0.8 m", "rocks/Otira_1cm_grains.ply", TETRAPOD.format(0.8)),
    ]:
        if (data / file).is_file():
            cloud = without_crs(data / file, folder) if file.endswith(".laz") else data / file
            yield name, [cloud], entry, "at most 1 in 500,000 points", []
    for scan in sorted((data / "realsense_pipes").glob("90_real_*.ply")):
        shutil.copy(data / "realsense_pipes" / "Pipe_02.stl", folder)
        yield f"pipes {scan.stem}", [scan], PIPE, "fit below 3 mm", ["--sensor", "depth-camera"]


def table(data, runs, recognise, say):
    """Lines of the table."""
    out = ["| real cloud | stated | at .5+ | median confidence | median fit mm | s | should be |", "|---|---|---|---|---|---|---|"]
    folder = runs / "real"
    folder.mkdir(parents=True, exist_ok=True)
    for name, clouds, entry, want, options in cases(data, folder):
        run = folder / name.replace(" ", "-").replace(",", "")
        catalog = run.with_suffix(".toml")
        catalog.write_text(entry)
        did = recognise(clouds, catalog, run, options)
        rows = score.read(run / "recognise" / "blocks.csv")
        confidence = [float(r["confidence"]) for r in rows]
        fit = [float(r["fitness_m"]) * 1000 for r in rows]
        middle = lambda v, digits: f"{statistics.median(v):.{digits}f}" if v else "–"
        out.append(
            f"| {name} | {len(rows)} | {sum(c >= 0.5 for c in confidence)} | {middle(confidence, 3)} | {middle(fit, 1)} | "
            f"{did['seconds']:.1f} | {want}{'; REFUSED' if did['status'] else ''} |"
        )
        say(out[-1])
    return out
