// The design as the program reads it, for a look at once: levels, sections, and the space below.

// Distance to the left of a polyline, with the length along it; null beyond its ends.
export function along(line, e, n) {
  let best = null, length = 0;
  for (let i = 0; i + 1 < line.length; i++) {
    const [ax, ay] = line[i], dx = line[i + 1][0] - ax, dy = line[i + 1][1] - ay, long = Math.hypot(dx, dy);
    if (!long) continue;
    const u = ((e - ax) * dx + (n - ay) * dy) / long, first = i === 0, end = i + 2 === line.length;
    if ((u >= 0 || !first) && (u <= long || !end)) {
      const on = Math.min(long, Math.max(0, u)), away = Math.hypot(e - ax - dx * on / long, n - ay - dy * on / long), left = (dx * (n - ay) - dy * (e - ax)) >= 0 ? 1 : -1;
      if (!best || away < best.away) best = { away, offset: away * left, at: length + on };
    }
    length += long;
  }
  return best;
}

export const lengthOf = line => line.slice(1).reduce((sum, p, i) => sum + Math.hypot(p[0] - line[i][0], p[1] - line[i][1]), 0);

// The point so far along a polyline, and the direction there.
export function pointAt(line, at) {
  for (let i = 0; i + 1 < line.length; i++) {
    const dx = line[i + 1][0] - line[i][0], dy = line[i + 1][1] - line[i][1], long = Math.hypot(dx, dy);
    if (at <= long || i + 2 === line.length) return { e: line[i][0] + dx * at / long, n: line[i][1] + dy * at / long, de: dx / long, dn: dy / long };
    at -= long;
  }
  return null;
}

function inside(corners, e, n) {
  let is = false;
  for (let i = 0, j = corners.length - 1; i < corners.length; j = i++) {
    const [ax, ay] = corners[i], [bx, by] = corners[j];
    if ((ay > n) !== (by > n) && e < (bx - ax) * (n - ay) / (by - ay) + ax) is = !is;
  }
  return is;
}

const known = (...values) => values.every(Number.isFinite);

// A function of place, or null for a design that the page cannot work out itself.
export function levels(design, line) {
  if (!design) return null;
  if (design.kind === "level" && design.boundary.length > 2 && known(design.level_m)) return (e, n) => inside(design.boundary, e, n) ? design.level_m : NaN;
  if (design.kind !== "section" || line.length < 2) return null;
  const { crest_level_m: crest, crest_width_m: width, left_slope_m: left, right_slope_m: right, toe_level_m: toe } = design;
  if (!known(crest, width, left, right, toe)) return null;
  return (e, n) => {
    const place = along(line, e, n);
    if (!place) return NaN;
    const level = crest - Math.max(0, Math.abs(place.offset) - width / 2) / (place.offset > 0 ? left : right);
    return level >= toe ? level : NaN;
  };
}

// Design of every cell of a map: worked out here where that can be, else as the check has read it.
export function designOnMap(map, design, line) {
  const level = levels(design, line);
  if (!level) return design && design.kind !== "level" && design.kind !== "section" && map.design_m.length ? map.design_m.map(v => v ?? NaN) : null;
  return map.survey_m.map((_, i) => level(map.west_m + (i % map.columns + 0.5) * map.cell_m, map.north_m - (Math.floor(i / map.columns) + 0.5) * map.cell_m));
}

// Volume between what was surveyed and the design above it, and the works' area; cells nobody surveyed count as average ones.
export function spaceBelow(map, design) {
  let volume = 0, seen = 0, area = 0;
  const cell = map.cell_m ** 2;
  design.forEach((level, i) => {
    if (!Number.isFinite(level)) return;
    area += cell;
    if (map.survey_m[i] !== null) { seen += cell; volume += Math.max(0, level - map.survey_m[i]) * cell; }
  });
  return { volume: seen ? volume * area / seen : NaN, area };
}
