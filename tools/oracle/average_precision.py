"""Golden values for crates/metrics/src/average_precision.rs: ScanNet's AP for one class, written after its
published formula with NumPy (np.unique, cumulative sums, convolution by [-0.5, 0, 0.5]). Run: python3 average_precision.py"""
import numpy as np


def ap_at(pred, truth, score, limit):
    y_true, y_score, missed = [], [], 0
    used = set()
    for t in [t for t in np.unique(truth) if t]:
        found = None
        for p in [p for p in np.unique(pred) if p]:
            inter = np.sum((pred == p) & (truth == t))
            iou = inter / (np.sum(pred == p) + np.sum(truth == t) - inter)
            if iou > limit:
                used.add(p)
                if found is None:
                    found = score[p - 1]
                else:
                    y_true.append(0), y_score.append(min(found, score[p - 1]))
                    found = max(found, score[p - 1])
        if found is None:
            missed += 1
        else:
            y_true.append(1), y_score.append(found)
    for p in [p for p in np.unique(pred) if p and p not in used]:
        y_true.append(0), y_score.append(score[p - 1])
    order = np.argsort(y_score)
    y_score, y_true = np.array(y_score)[order], np.array(y_true)[order]
    cum = np.append(np.cumsum(y_true), 0)
    _, first = np.unique(y_score, return_index=True)
    precision, recall = np.zeros(len(first) + 1), np.zeros(len(first) + 1)
    for k, i in enumerate(first):
        below = cum[i - 1]
        tp = y_true.sum() - below
        precision[k] = tp / (len(y_score) - i)
        recall[k] = tp / (tp + below + missed)
    precision[-1], recall[-1] = 1.0, 0.0
    steps = np.convolve(np.append(np.append(recall[0], recall), 0.0), [-0.5, 0, 0.5], "valid")
    return float(np.dot(precision, steps))


truth = np.arange(60) // 10
pred = truth.copy()
pred[10] = 0
pred[20:24] = 0
pred[30:37] = 0
pred[40] = 5
pred[0:4] = 6
score = [0.9, 0.8, 0.7, 0.6, 0.6, 0.95]
print(ap_at(pred, truth, score, 0.5), ap_at(pred, truth, score, 0.25),
      np.mean([ap_at(pred, truth, score, 0.5 + 0.05 * i) for i in range(9)]))
