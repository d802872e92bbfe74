"""Writes crates/io/src/crs/epsg_table.rs from the EPSG register as pyproj carries it (pip install pyproj==3.7.2)."""

import os
import sqlite3
import sys

import pyproj

HEAD = """//! What the codes of the EPSG register (version {version}) mean, as runs of codes; written by `tools/epsg_table.py`.
//!
//! Projected systems in metres are the rule and are not listed. A run may bridge numbers that are no code.

use super::epsg::Entry::{{self, Depth, Feet, Geocentric, Geographic, Height}};

"""


def classes(db):
    """Code -> Rust expression of what it means, for everything but projected systems in metres (None)."""
    axis = """join axis a on a.coordinate_system_auth_name = p.coordinate_system_auth_name
        and a.coordinate_system_code = p.coordinate_system_code
        join unit_of_measure u on u.auth_name = a.uom_auth_name and u.code = a.uom_code
        where p.auth_name = 'EPSG'"""
    out = {}
    for code, kind in db.execute("select code, type from geodetic_crs where auth_name = 'EPSG'"):
        out[int(code)] = "Geocentric" if kind == "geocentric" else "Geographic"
    for code, unit in db.execute(
        f"select p.code, u.conv_factor from projected_crs p {axis} and a.coordinate_system_order = 1"
    ):
        out[int(code)] = None if unit == 1 else f"Feet({unit!r})"
    for code, unit, way in db.execute(
        f"select p.code, u.conv_factor, a.orientation from vertical_crs p {axis}"
    ):
        out[int(code)] = f"{'Depth' if way == 'down' else 'Height'}({unit!r})"
    return out


def main(target):
    db = sqlite3.connect(os.path.join(pyproj.datadir.get_data_dir(), "proj.db"))
    meaning = classes(db)
    compounds = {
        int(c): (int(h), int(v))
        for c, h, v in db.execute(
            """select code, horiz_crs_code, vertical_crs_code from compound_crs where auth_name = 'EPSG'
            and horiz_crs_auth_name = 'EPSG' and vertical_crs_auth_name = 'EPSG'"""
        )
    }
    runs, before = [], None
    for code in sorted({**meaning, **compounds}):
        kind = None if code in compounds else meaning[code]
        if kind is not None and kind == before:
            runs[-1][1] = code
        elif kind is not None:
            runs.append([code, code, kind])
        before = kind
    version = dict(db.execute("select key, value from metadata"))["EPSG.VERSION"]
    with open(target, "w", encoding="utf-8") as out:
        out.write(HEAD.format(version=version))
        out.write("/// First and last code of a run and what they mean, in order.\n#[rustfmt::skip]\n")
        out.write(f"pub(super) const RUNS: [(u32, u32, Entry); {len(runs)}] = [\n")
        lines(out, [f"({a}, {b}, {kind})" for a, b, kind in runs])
        out.write("];\n\n/// Compound code, its horizontal and its vertical system, in order.\n#[rustfmt::skip]\n")
        out.write(f"pub(super) const COMPOUNDS: [(u32, u32, u32); {len(compounds)}] = [\n")
        lines(out, [f"({c}, {h}, {v})" for c, (h, v) in sorted(compounds.items())])
        out.write("];\n")


def lines(out, items):
    line = "   "
    for item in items:
        if len(line) + len(item) + 2 > 98:
            out.write(line + "\n")
            line = "   "
        line += " " + item + ","
    out.write(line + "\n")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "crates/io/src/crs/epsg_table.rs")
