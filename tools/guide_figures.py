#!/usr/bin/env python3
"""Draws the figures of the guide that show no result: the words of a design, and how to fly and sound a breakwater.

    python3 tools/guide_figures.py            # writes docs/guide/images/*.svg

Needs Python alone. English and Japanese stand in one figure, so that both guides share it.
"""

from pathlib import Path

OUT = Path(__file__).resolve().parent.parent / "docs/guide/images"
BLUE, RED, ORANGE, INK, SOFT, STONE, WATER = "#0072b2", "#c21f3a", "#d55e00", "#16202b", "#566473", "#b9b1a4", "#cfe3f1"


class Figure:
    def __init__(self, wide, tall):
        self.wide, self.tall, self.parts = wide, tall, []

    def line(self, points, colour=INK, width=2, dash="", arrow="", fill="none"):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        extra = (f' stroke-dasharray="{dash}"' if dash else "") + "".join(f' marker-{end}="url(#tip)"' for end in arrow.split())
        self.parts.append(f'<polyline points="{path}" fill="{fill}" stroke="{colour}" stroke-width="{width}"{extra}/>')

    def area(self, points, colour, opacity=1.0):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(f'<polygon points="{path}" fill="{colour}" fill-opacity="{opacity}"/>')

    def circle(self, x, y, r, colour=INK, fill="none"):
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r}" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>')

    def text(self, x, y, words, colour=INK, anchor="middle", size=14, weight=400):
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}" font-size="{size}" font-weight="{weight}">{words}</text>')

    def both(self, x, y, english, japanese, **more):
        self.text(x, y, english, **more)
        self.text(x, y + 16, japanese, **{**more, "size": 12})

    def save(self, name):
        tip = f'<marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto-start-reverse"><path d="M0 0 L10 5 L0 10 z" fill="{SOFT}"/></marker>'
        body = "\n".join(self.parts)
        font = "system-ui, 'Segoe UI', 'Noto Sans JP', 'Noto Sans CJK JP', 'Hiragino Sans', sans-serif"
        text = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.wide} {self.tall}" font-family="{font}"><defs>{tip}</defs>\n<rect width="{self.wide}" height="{self.tall}" fill="#fff"/>\n{body}\n</svg>\n'
        (OUT / name).write_text(text, encoding="utf-8")


def pile(figure, top, low, spread=17):
    """Blocks as circles below a surface that falls from the middle to both sides; the height of the heap at a place."""
    circles, r = [], spread / 2 - 0.5
    for row in range(9):
        y = low - row * spread * 0.86
        for i in range(60):
            x = 70 + (i + row % 2 / 2) * spread
            if y > top(x) + spread * 0.6 and x < figure.wide - 60:
                figure.circle(x, y, r, SOFT, "#e3e7eb")
                circles.append((x, y))
    inside = lambda x: [y - (r * r - (x - cx) ** 2) ** 0.5 for cx, y in circles if abs(x - cx) < r]
    return lambda x: min(inside(x), default=low + 8)


def section():
    f = Figure(860, 400)
    # Metres of an example, 34 pixels a metre: crest 6 m wide at +3.4 m, slopes 1:1.5, ending at +1.0 m.
    s, middle, crest, toe = 34, 430, 120, 120 + 2.4 * 34
    half, out = 3 * s, 3 * s + 2.4 * 1.5 * s
    bed = 340
    f.area([(40, bed), (820, bed), (820, 372), (40, 372)], STONE)
    surface = lambda x: 175 + abs(x - 455) * 0.32 + 9 * ((x // 40) % 2)
    heap = pile(f, surface, bed - 8)
    f.line([(x, heap(x)) for x in range(50, 812, 3)], BLUE, 2)
    design = [(middle - out, toe), (middle - half, crest), (middle + half, crest), (middle + out, toe)]
    f.line(design, RED, 3, "9 5")
    below = [(x, heap(x)) for x in range(middle - int(out), middle + int(out), 3)]
    f.area(design + [p for p in reversed(below)], RED, 0.10)
    f.line([(middle - half, crest - 26), (middle + half, crest - 26)], SOFT, 1.5, arrow="start end")
    f.both(middle, crest - 52, "crest_width_m", "天端幅", size=14)
    f.line([(60, crest), (middle - half - 8, crest)], SOFT, 1, "3 3")
    f.both(66, crest - 24, "crest_level_m", "天端高", anchor="start")
    f.line([(60, toe), (middle - out - 6, toe)], SOFT, 1, "3 3")
    f.both(66, toe - 24, "toe_level_m", "法尻の高さ", anchor="start")
    for side, x, words, ja in [(-1, middle - half - 130, "1 : left_slope_m", "左側法面勾配"), (1, middle + half + 130, "1 : right_slope_m", "右側法面勾配")]:
        f.both(x, crest + 24, words, ja)
    f.text(middle, 158, "space below the design 不足量", RED, weight=600)
    f.both(790, 250, "survey", "測量", colour=BLUE)
    f.text(430, 392, "seen along the alignment, from its first point towards its last 法線の始点から終点を見た断面", SOFT, size=13)
    f.line([(middle, 66), (middle, bed)], SOFT, 1, "12 4 2 4")
    f.save("design-section.svg")


def plan():
    f = Figure(860, 330)
    line = [(120, 230), (430, 150), (740, 150)]
    import math

    def offset(points, far):
        out = []
        for i, (x, y) in enumerate(points):
            a, b = points[max(0, i - 1)], points[min(len(points) - 1, i + 1)]
            dx, dy = b[0] - a[0], b[1] - a[1]
            long = math.hypot(dx, dy)
            out.append((x + dy / long * far, y - dx / long * far))
        return out

    for far, opacity in ((88, 0.16), (44, 0.16)):
        f.area(offset(line, far) + offset(line, -far)[::-1], ORANGE, opacity)
    f.line(line, RED, 3, arrow="end")
    for i, (x, y) in enumerate(line):
        f.circle(x, y, 5, RED, RED)
        f.text(x + (0, 0, 54)[i], y + (22, 26, 26)[i], f"[{['41230.0, -98760.0', '41270.0, -98749.6', '41310.0, -98749.6'][i]}]", SOFT, size=12)
    f.both(120, 258 + 10, "first point", "始点", colour=INK)
    f.both(794, 196, "last point", "終点", colour=INK)
    f.both(300, 112, "left", "左側", weight=600)
    f.both(360, 262, "right", "右側", weight=600)
    f.text(600, 172, "alignment 法線", RED, weight=600)
    f.text(600, 92, "slope 法面", size=12)
    f.text(600, 132, "crest 天端", size=12)
    f.line([(60, 110), (60, 50)], INK, 2, arrow="end")
    f.text(60, 42, "N", weight=600)
    f.text(430, 318, "points are [east, north]; the works end where the alignment ends 座標は [東（Y）, 北（X）]、計画範囲は法線の両端まで", SOFT, size=13)
    f.save("design-plan.svg")


def flying():
    f = Figure(860, 360)
    sea = 235
    f.area([(0, sea), (860, sea), (860, 330), (0, 330)], WATER)
    f.area([(210, 330), (330, sea - 50), (530, sea - 50), (650, 330)], STONE, 0.9)
    for row in range(9):
        y = 322 - row * 17
        for i in range(40):
            x = 200 + i * 19 + row % 2 * 9
            top = max(sea - 62, 330 - (min(x - 200, 660 - x)) * 1.12)
            if 200 < x < 660 and y > top and y > sea - 62 and (x < 330 or x > 530 or y < sea - 36):
                f.circle(x, y, 8.5, SOFT, "#e9ecef")
    for x, tilt in ((250, 34), (430, 0), (610, -34)):
        f.line([(x - 16, 52), (x + 16, 52)], INK, 3)
        f.circle(x - 16, 48, 7)
        f.circle(x + 16, 48, 7)
        f.line([(x, 58), (x + tilt * 3.2 - 46, sea - 60)], BLUE, 1, "4 4")
        f.line([(x, 58), (x + tilt * 3.2 + 46, sea - 60)], BLUE, 1, "4 4")
    f.both(430, 22, "drone: crossing lines, straight down and 30–45° from both sides", "UAV：交差する測線、直下と両側から 30～45° の斜め撮影", size=14)
    for x, side in ((90, 1), (770, -1)):
        f.area([(x - 34, sea - 6), (x + 34, sea - 6), (x + 22, sea + 10), (x - 22, sea + 10)], INK)
        f.line([(x, sea + 10), (x + side * 30, 330)], ORANGE, 1, "4 4")
        f.line([(x, sea + 10), (x + side * 205, sea + 6)], ORANGE, 1, "4 4")
    f.both(92, sea - 44, "sounder tilted", "傾斜させたソナー", size=13)
    f.both(770, sea - 44, "both sides, high water", "両側から、満潮時", size=13)
    f.both(700, 112, "overlap: surveys share", "重複：水際の帯を", size=13)
    f.text(700, 144, "1–2 m around the waterline 1～2 m 重ねる", size=13)
    f.line([(640, 150), (590, sea - 8)], SOFT, 1.5, arrow="end")
    f.text(430, 350, "no block is seen from above alone: walls and undersides decide its attitude 姿勢は側面・下面の点で決まる", SOFT, size=13)
    f.save("survey-plan.svg")


def tonnage():
    f = Figure(860, 340)
    left, right, low, high = 80, 830, 290, 30
    import math

    x = lambda t: left + (math.log10(t) - math.log10(0.5)) / (math.log10(80) - math.log10(0.5)) * (right - left)
    y = lambda h: low - h / 6 * (low - high)
    for t in (0.5, 1, 2, 5, 10, 20, 50, 80):
        f.line([(x(t), low), (x(t), high)], "#e3e8ed", 1)
        f.text(x(t), low + 18, f"{t:g}", SOFT, size=12)
    for h in range(0, 7):
        f.line([(left, y(h)), (right, y(h))], "#e3e8ed", 1)
        f.text(left - 10, y(h) + 4, str(h), SOFT, anchor="end", size=12)
    for name, k, colour in (("tetrapod h", 0.28, BLUE), ("dolos C", 0.16, ORANGE), ("cube edge", 1.0, INK), ("six-leg-like", 0.176, RED)):
        ts = [0.5 * 160 ** (i / 60) for i in range(61)]
        f.line([(x(t), y((t / 2.3 / k) ** (1 / 3))) for t in ts], colour, 2.5)
    for name, k, colour, dy in (("dolos C", 0.16, ORANGE, -14), ("six-leg-like", 0.176, RED, 30), ("tetrapod h", 0.28, BLUE, 26), ("cube edge", 1.0, INK, 26)):
        f.text(x(52), y((52 / 2.3 / k) ** (1 / 3)) + dy, name, colour, anchor="end", weight=600)
    f.text((left + right) / 2, 332, "nominal tonnage, t (2,300 kg/m³) 公称質量 (t)", SOFT, size=13)
    f.text(left + 6, high + 4, "size, m 大きさ (m)", SOFT, anchor="start", size=13)
    f.save("tonnage.svg")


if __name__ == "__main__":
    for draw in (section, plan, flying, tonnage):
        draw()
    print("\n".join(str(p) for p in sorted(OUT.glob("*.svg"))))
