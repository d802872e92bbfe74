"""Figures of one labelled cloud against another, in NumPy and SciPy, by nobody's code but this: what `tsumu evaluate --labels
--json` says, computed again.

    python3 label_figures.py TRUTH RESULT TOLERANCE [IOU] [--check FIGURES.json]

TRUTH and RESULT: text `x y z … instance` without a head, the last column the instance, or .npy of the same columns. Numbers below 1 mean
none. Without confidences all instances weigh the same. With --check it compares with the JSON of `--out` and ends with 1 where
a figure differs by more than 1e-9.
"""
import json
import sys

import numpy as np
from scipy.spatial import cKDTree


def read(path):
    table = np.load(path) if path.endswith(".npy") else np.loadtxt(path, ndmin=2, delimiter=None)
    return table[:, :3].astype(float), table[:, -1].astype(np.int64)


def nearest(of, among, tolerance):
    distance, index = cKDTree(among).query(of, distance_upper_bound=tolerance * (1 + 1e-12))
    return np.where(np.isfinite(distance), index, -1)


def average_precision(iou, truths, predictions, limit):
    """ScanNet: evaluate_semantic_instance.py, one class, no void, every score 1."""
    hits, scores, missed, used = [], [], 0, set()
    for t in truths:
        found = False
        for p in predictions:
            if iou.get((p, t), 0.0) > limit:
                used.add(p)
                hits.append(not found)  # a second prediction of the same truth is wrong
                scores.append(1.0)
                found = True
        missed += not found
    for p in predictions:
        if p not in used:
            hits.append(False)
            scores.append(1.0)
    if not truths:
        return 0.0 if hits else float("nan")
    if not hits:
        return 0.0
    hits, scores = np.array(hits), np.array(scores)
    order = np.argsort(scores, kind="stable")
    hits, scores = hits[order], scores[order]
    _, first = np.unique(scores, return_index=True)
    cumulated = np.append(np.cumsum(hits), 0)
    precision, recall = np.zeros(len(first) + 1), np.zeros(len(first) + 1)
    for k, i in enumerate(first):
        below = cumulated[i - 1]
        right = hits.sum() - below
        precision[k] = right / (len(hits) - i)
        recall[k] = right / (right + below + missed)
    precision[-1] = 1.0
    padded = np.concatenate([[recall[0]], recall, [0.0]])
    steps = np.convolve(padded, [-0.5, 0, 0.5], "valid")
    return float(np.dot(precision, steps))


def figures(truth_xyz, truth, result_xyz, result, tolerance, limit):
    partner = nearest(truth_xyz, result_xyz, tolerance)
    known = nearest(result_xyz, truth_xyz, tolerance)
    outside = {i for i in np.unique(result[result > 0]) if 2 * (known[result == i] < 0).sum() > (result == i).sum()}
    predicted = np.where(partner < 0, 0, result[partner])
    predicted = np.where(np.isin(predicted, list(outside)) if outside else False, 0, predicted)
    truths = sorted(set(truth[truth > 0]))
    predictions = sorted(set(predicted[predicted > 0]))
    iou = {}
    for t in truths:
        for p in set(predicted[truth == t]) - {0}:
            both = ((truth == t) & (predicted == p)).sum()
            iou[p, t] = both / ((truth == t) | (predicted == p)).sum()
    pairs = sorted(((v, k) for k, v in iou.items() if v >= limit), key=lambda x: (-x[0], x[1]))
    used_p, used_t = set(), set()
    for _, (p, t) in pairs:
        if p not in used_p and t not in used_t:
            used_p.add(p)
            used_t.add(t)
    right = len(used_p)
    best = np.array([max([iou.get((p, t), 0.0) for p in predictions], default=0.0) for t in truths])
    size = np.array([(truth == t).sum() for t in truths])
    limits = [0.5 + 0.05 * i for i in range(9)]
    return {
        "true_positives": right,
        "false_positives": len(predictions) - right,
        "false_negatives": len(truths) - right,
        "precision": right / len(predictions) if predictions else None,
        "recall": right / len(truths),
        "ap": float(np.mean([average_precision(iou, truths, predictions, x) for x in limits])),
        "ap50": average_precision(iou, truths, predictions, 0.5),
        "ap25": average_precision(iou, truths, predictions, 0.25),
        "coverage": float(best.mean()),
        "weighted_coverage": float((best * size).sum() / size.sum()),
        "true_points": len(truth),
        "result_points": len(result),
        "unmatched_true_points": int((partner < 0).sum()),
        "unmatched_result_points": int((known < 0).sum()),
        "instances_outside_the_truth": len(outside),
    }


def main():
    words = sys.argv[1:]
    check = words[words.index("--check") + 1] if "--check" in words else None
    words = words[: words.index("--check")] if check else words
    limit = float(words[3]) if len(words) > 3 else 0.5
    got = figures(*read(words[0]), *read(words[1]), float(words[2]), limit)
    if check is None:
        print(json.dumps(got, indent=1))
        return
    with open(check, encoding="utf-8") as file:
        said = json.load(file)
    wrong = [k for k, v in got.items() if said[k] != v and not (v is not None and said[k] is not None and abs(said[k] - v) < 1e-9)]
    for key in wrong:
        print(f"{key}: the program says {said[key]}, this {got[key]}")
    print(f"{len(got) - len(wrong)} of {len(got)} figures agree")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
