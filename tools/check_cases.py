"""Small inputs in the manner of real bug reports through the built program: each must give what is right or be refused by name.

python tools/check_cases.py FOLDER target/release/tsumu [NAME…]

FOLDER holds the files named below with reference-5m.laz and reference-8m.laz, the surveys that clouds and designs are held against.
"""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

CATALOG = '[[block]]\nname = "tetrapod"\nshape = { kind = "tetrapod", size = 2.0 }\n'
SITE = """name = "case"
crs = "EPSG:6679"
axis_order = "{axes}"
[[survey]]
file = "{survey}"
sensor = "uav"
vertical_offset_m = 0.0
"""
LEVEL = """[design]
kind = "level"
level_m = 3.4
boundary = [[41247.5, -98762.5], [41252.5, -98762.5], [41252.5, -98757.5], [41247.5, -98757.5]]
"""
DESIGN = '[design_file]\nfile = "{design}"\ncell_m = 0.1\n{more}'


class Result:
    def __init__(self, code, out, err):
        self.code, self.text = code, out + err
        events = [json.loads(line) for line in out.splitlines() if line.startswith("{")]
        value = next((e["value"] for e in events if e["event"] in ("run", "segmented")), None)
        self.value = value
        recognised, planned = (value or {}).get("recognised") or {}, (value or {}).get("planned") or {}
        self.found, self.planned = recognised.get("recognised_blocks"), planned.get("blocks")
        self.void = planned.get("void_before_m3")

    def line(self):
        first = next((l for l in self.text.splitlines() if l.startswith("tsumu: ")), "")
        void = f"{self.void:.1f}" if self.void is not None else "-"
        return f"exit {self.code}, {self.found} blocks, {self.planned} planned, void {void} {first}"


def as_reference(r):
    """Blocks come and go at the border of the cut: void and plan tell."""
    return r.code == 0 and 4 <= r.planned <= 7 and abs(r.void - 36.5) < 2.5


def refused(*words):
    return lambda r: r.code == 2 and all(w in r.text for w in words)


def either(*checks):
    return lambda r: any(c(r) for c in checks)


def planned(low, high):
    return lambda r: r.code == 0 and low <= r.planned <= high


def said(check, *words):
    return lambda r: check(r) and all(w in r.text for w in words)


CLOUDS = {
    "reference-5m.laz": as_reference,
    "noise-class-7-18.laz": said(as_reference, "class 7"),
    "crs-of-zone-9.laz": refused("6677", "6679"),
    "heights-in-feet-compound.laz": either(as_reference, refused("foot")),
    "crs-in-evlr.laz": as_reference,
    "attributes-format-7.laz": as_reference,
    "laz-format-4.laz": lambda r: r.code in (0, 1) and "LASzip" not in r.text,
    "scale-0.1.las": refused("steps of 0.1"),
    "semicolon-comma-decimals.csv": as_reference,
    "point-number-first.csv": either(as_reference, refused("number")),
    "hash-header-y-x-z.txt": as_reference,
    "northing-easting-names.csv": as_reference,
    "cr-only-lines.xyz": as_reference,
    "nodata-minus-9999.csv": either(as_reference, refused("-9999")),
    "stray-1km.csv": as_reference,
    "utf-16-no-bom.txt": either(lambda r: r.code in (0, 1), refused("UTF-16")),
    "label-minus-1.ply": as_reference,
    "pose-is-a-shift.e57": as_reference,
}
AXES = {"northing-easting-names.csv": "north-east"}
DESIGNS = {
    "crs-of-zone-9.tif": refused("6677", "6679"),
    "existing-ground-first.xml": refused("EG", "FG"),
    "linear-unit-millimeter.xml": either(planned(11, 13), refused("illimet")),
    "int16-scale-0.01.tif": planned(11, 14),
    "nodata-minus-9999.9.tif": planned(8, 11),  # a quarter of it is not designed
    "unused-block.dxf": planned(11, 14),
    "layer-off.dxf": planned(11, 14),
}
MESHES = {
    "concave-ngon.obj": ("m", lambda r: r.code == 0 and "3.06" in r.text and "2 convex parts of 100.0" in r.text),
    "far-from-origin.obj": ("m", lambda r: r.code == 0 and "2.2388 m³" in r.text and "12 rotations" in r.text),
    "shell-twice.stl": ("m", either(lambda r: r.code == 0 and "8.0000 m³" in r.text, refused("each other"))),
    "solid-header-trailing-bytes.stl": ("m", lambda r: r.code == 0),
}


def tsumu(program, *words):
    ran = subprocess.run([program, *map(str, words)], capture_output=True, text=True, errors="replace")
    return Result(ran.returncode, ran.stdout, ran.stderr)


def run_site(program, folder, files, site):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file in files:
        shutil.copy(file, folder / file.name)
    (folder / "catalog.toml").write_text(CATALOG)
    (folder / "site.toml").write_text(site)
    return tsumu(program, "run", folder, "--plans", 0, "--threads", 1, "--json")


def cases(data, program, work):
    for name, check in CLOUDS.items():
        site = SITE.format(survey=name, axes=AXES.get(name, "east-north")) + LEVEL
        yield name, check, lambda n=name, s=site: run_site(program, work / n, [data / n], s)
    for name, check in DESIGNS.items():
        files = [data / "reference-8m.laz", data / name]
        site = SITE.format(survey="reference-8m.laz", axes="east-north") + DESIGN.format(design=name, more="")
        yield name, check, lambda n=name, f=files, s=site: run_site(program, work / n, f, s)
    name = "existing-ground-first.xml"
    files = [data / "reference-8m.laz", data / name]
    site = SITE.format(survey="reference-8m.laz", axes="east-north") + DESIGN.format(design=name, more='surface = "FG"\n')
    yield name + " with surface", planned(11, 13), lambda: run_site(program, work / "fg", files, site)
    for name, (unit, check) in MESHES.items():
        catalog = work / f"{name}.toml"
        shutil.copy(data / name, work / name)
        catalog.write_text(f'[[block]]\nname = "own"\nmesh = "{name}"\nunit = "{unit}"\n')
        words = ["segment", data / "reference-5m.laz", "--catalog", catalog, "--out", work / f"{name}.laz", "-v"]
        yield name, check, lambda w=words: tsumu(program, *w)


def main():
    data, program, wanted = pathlib.Path(sys.argv[1]).absolute(), sys.argv[2], sys.argv[3:]
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        for case, check, run in cases(data, program, pathlib.Path(name)):
            if wanted and not any(w in case for w in wanted):
                continue
            result = run()
            right = check(result)
            failed += not right
            print(f"{'right' if right else 'WRONG'} {case}: {result.line()}", flush=True)
    sys.exit(f"{failed} are wrong" if failed else 0)


if __name__ == "__main__":
    main()
