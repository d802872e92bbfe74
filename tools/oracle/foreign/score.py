"""Statements of a run against the truth of its scene, counted by the rules of `tsumu evaluate` but by other code.

A statement is right when its centre is within 0.1 d_box and its rotation within 5° modulo symmetry of a true block nobody else
has; blocks hidden to 80 % or more are not scored, and a statement that meets one counts neither way.
"""

import csv
import json
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

HIDDEN = 0.8


@dataclass
class Score:
    scenes: int = 0
    asked: int = 0
    stated: int = 0
    right: int = 0
    wrong: int = 0
    not_judged: int = 0
    warned: int = 0
    refused: int = 0
    seconds: float = 0.0
    displaced_m: list = field(default_factory=list)
    turned_deg: list = field(default_factory=list)
    statements: list = field(default_factory=list)  # (confidence, right)
    flagged: list = field(default_factory=list)  # (truly broken, flagged)

    def __add__(self, other):
        return Score(*(getattr(self, k) + getattr(other, k) for k in self.__dataclass_fields__))

    @property
    def precision(self):
        return self.right / (self.right + self.wrong) if self.right + self.wrong else None

    @property
    def recall(self):
        return self.right / self.asked if self.asked else None

    def stated_from(self, confidence):
        return sum(c >= confidence for c, _ in self.statements)

    def right_from(self, confidence):
        """Share right of the statements at or above the confidence, and how many these are."""
        these = [ok for c, ok in self.statements if c >= confidence]
        return (sum(these) / len(these) if these else None), len(these)


def read(path):
    if not path.is_file():
        return []
    with open(path) as f:
        return list(csv.DictReader(f))


def pose(row):
    number = lambda keys: np.array([float(row[k]) for k in keys])
    return Rotation.from_quat(number(["qx", "qy", "qz", "qw"])), number(["x_m", "y_m", "z_m"])


def score(scene_dir, run_dir):
    """One scene. The blocks' meshes have their centre of mass at their origin, so positions are centres."""
    facts = json.loads((scene_dir / "scene.json").read_text())
    truth, stated = read(scene_dir / "truth.csv"), read(run_dir / "recognise" / "blocks.csv")
    group = Rotation.from_quat(facts["group_xyzw"])
    out = Score(scenes=1, stated=len(stated), not_judged=len(read(run_dir / "recognise" / "not_judged.csv")))
    out.asked = sum(float(t["occlusion"]) < HIDDEN for t in truth)
    pairs = []
    for e, row in enumerate(stated):
        turn, at = pose(row)
        for t, true in enumerate(truth):
            true_turn, true_at = pose(true)
            away = float(np.linalg.norm(at - true_at))
            if away > 0.1 * facts["d_box_m"]:
                continue
            angle = float(np.degrees((turn.inv() * true_turn * group).magnitude().min()))
            if angle <= 5.0:
                pairs.append((away, e, t, angle))
    met, taken = {}, set()
    for away, e, t, angle in sorted(pairs):
        if e not in met and t not in taken:
            met[e] = (t, away, angle)
            taken.add(t)
    broken = {row["block_id"] for row in read(scene_dir / "broken.csv")}
    for e, row in enumerate(stated):
        confidence = float(row["confidence"])
        if e not in met:
            out.wrong += 1
            out.statements.append((confidence, False))
            continue
        t, away, angle = met[e]
        if row.get("damage") is not None:
            out.flagged.append((truth[t]["block_id"] in broken, row["damage"] not in ("", "no", "none")))
        if float(truth[t]["occlusion"]) >= HIDDEN:
            continue
        right = row["model"] == truth[t]["model"] or row.get("type_judged") == "no"
        out.right += right
        out.wrong += not right
        out.displaced_m.append(away)
        out.turned_deg.append(angle)
        out.statements.append((confidence, right))
    return out
