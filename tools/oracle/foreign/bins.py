"""The five bin parts as a depth camera sees them, recognised with default settings: bin seen, cropped, parts on a table.

These scenes are made by `tsumu synth`, not by another engine: what is judged is what becomes of floor and walls.
"""

import json
import subprocess
import tomllib
from pathlib import Path

RECIPES = Path(__file__).parents[3] / "recipes"
PARTS = ("bracket", "eye-bolt", "gear-shaft", "holed-plate", "hook-plate")
WAYS = {
    "seen": {},
    "cropped": {"delivery": {"crop": 0.6}},
    "table": {"bin": {"measured": False}, "bed": {"stone_blocks": 0.0, "measured": True}},
    "nothing": {"bin": {"measured": False}},
}
HEAD = "| bin | scenes | asked | stated | P % | R % | E_d mm | E_R ° | n. j. | s |\n|---|---|---|---|---|---|---|---|---|---|"


def toml_of(table, prefix=""):
    """A table as TOML; numbers, texts, truths, lists and tables of these are all that recipes hold."""
    plain = {k: v for k, v in table.items() if not isinstance(v, dict) and not is_tables(v)}
    lines = [f"{k} = {json.dumps(v)}" for k, v in plain.items() if not isinstance(v, list) or not any(isinstance(x, dict) for x in v)]
    for key, value in table.items():
        if isinstance(value, dict):
            lines += [f"[{prefix}{key}]", toml_of(value, f"{prefix}{key}.")]
        elif is_tables(value):
            for entry in value:
                lines += [f"[[{prefix}{key}]]", toml_of(entry, f"{prefix}{key}.")]
    return "\n".join(lines)


def is_tables(value):
    return isinstance(value, list) and bool(value) and all(isinstance(x, dict) for x in value)


def made(tsumu, part, way, seeds, folder):
    """Folders of the scenes, made where they are missing, and the catalogue."""
    recipe = tomllib.loads((RECIPES / f"bin-{part}.toml").read_text())
    for table, keys in WAYS[way].items():
        recipe.setdefault(table, {}).update(keys)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recipe-in.toml").write_text(toml_of(recipe) + "\n")
    catalog = folder / "catalog.toml"
    catalog.write_text(toml_of({"block": recipe["catalog"]["block"]}) + "\n")
    scenes = []
    for seed in seeds:
        out = folder / str(seed)
        command = [tsumu, "synth", folder / "recipe-in.toml", "--scenes", 1, "--seed", seed, "--out", out, "--quiet"]
        subprocess.run([str(c) for c in command], check=True)
        scenes += sorted(p for p in (out / "scenes").iterdir() if p.is_dir())
    return scenes, catalog


def row(tsumu, part, way, seeds, folder, runs, recognise):
    """One line of the table, scored by `tsumu evaluate`."""
    scenes, catalog = made(tsumu, part, way, seeds, folder / f"{part}-{way}")
    total, seconds, displaced, turned = {}, 0.0, [], []
    for scene in scenes:
        run = runs / f"bin-{part}-{way}" / scene.parts[-3]
        did = recognise([scene / "cloud.ply"], catalog, run, ["--sensor", "depth-camera"])
        seconds += did["seconds"]
        figures = run / "figures.json"
        if not figures.is_file():
            command = [tsumu, "evaluate", "--truth", scene, "--result", run, "--catalog", catalog, "--out", figures, "--quiet"]
            subprocess.run([str(c) for c in command], check=True)
        got = json.loads(figures.read_text())
        for key in ("true_blocks_asked_for", "recognised_blocks", "pose_true_positives", "pose_false_positives", "pose_false_negatives", "not_judged_blocks"):
            total[key] = total.get(key, 0) + got[key]
        if got["mean_displacement_m"] is not None:
            displaced.append(got["mean_displacement_m"] * 1000)
            turned.append(got["mean_rotation_deg"])
    right = total["pose_true_positives"]
    share = lambda n: f"{100 * right / n:.1f}" if n else "–"
    mean = lambda v, digits: f"{sum(v) / len(v):.{digits}f}" if v else "–"
    return (
        f"| {part}, {way} | {len(scenes)} | {total['true_blocks_asked_for']} | {total['recognised_blocks']} | "
        f"{share(right + total['pose_false_positives'])} | {share(right + total['pose_false_negatives'])} | "
        f"{mean(displaced, 2)} | {mean(turned, 2)} | {total['not_judged_blocks']} | {seconds / max(len(scenes), 1):.1f} |"
    )


def table(tsumu, seeds, folder, runs, recognise, wanted, say):
    """Lines of the table."""
    out = [HEAD]
    for part in PARTS:
        for way in WAYS:
            name = f"bin-{part}-{way}"
            if wanted and not wanted & {"bins", f"bin-{part}", name}:
                continue
            out.append(row(tsumu, part, way, seeds, folder, runs, recognise))
            say(out[-1])
    return out if len(out) > 1 else []
