"""Real clouds of other people, where the folder is at hand: no truth, so counts, confidence and fit."""

import statistics

from . import score

TETRAPOD = '[[block]]\nname = "tetrapod"\nshape = {{ kind = "tetrapod", size = {} }}\n'
CUBE = '[[block]]\nname = "cube"\nshape = {{ kind = "cube", size = {} }}\n'


def pipe(data):
    return f'[[block]]\nname = "pipe"\nmesh = "{(data / "realsense_pipes" / "Pipe_01.stl").resolve()}"\nunit = "mm"\ndensity_kg_m3 = 1400.0\n'


def cases(data):
    """Name, clouds, catalogue, what should come out, further options."""
    singles = sorted((data / "ajaccio_tetrapods").glob("*.laz"))
    for cloud in singles:
        yield cloud.stem, [cloud], TETRAPOD.format(2.86), "at least 1, fit below 20 mm", []
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
            yield name, [data / file], entry, "at most 1 in 500,000 points", []
    for scan in sorted((data / "realsense_pipes").glob("90_real_*.ply")):
        yield f"pipes {scan.stem}", [scan], pipe(data), "fit below 3 mm", ["--sensor", "depth-camera"]


def table(data, runs, recognise, say):
    """Lines of the table."""
    out = ["| real cloud | stated | at .5+ | median confidence | median fit mm | s | should be |", "|---|---|---|---|---|---|---|"]
    for name, clouds, entry, want, options in cases(data):
        run = runs / "real" / name.replace(" ", "-").replace(",", "")
        catalog = run.with_suffix(".toml")
        catalog.parent.mkdir(parents=True, exist_ok=True)
        catalog.write_text(entry)
        did = recognise(clouds, catalog, run, options)
        rows = score.read(run / "recognise" / "blocks.csv")
        confidence = [float(r["confidence"]) for r in rows]
        fit = [float(r["fitness_m"]) * 1000 for r in rows]
        middle = lambda v, digits: f"{statistics.median(v):.{digits}f}" if v else "–"
        out.append(
            f"| {name} | {len(rows)} | {sum(c >= 0.5 for c in confidence)} | {middle(confidence, 3)} | {middle(fit, 1)} | "
            f"{did['seconds']:.1f} | {want} |"
        )
        say(out[-1])
    return out
