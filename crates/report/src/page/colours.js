// Colours by meaning, told apart by colour-blind people too (Okabe–Ito, cividis). One meaning, one colour: pink is
// chosen and nothing else is; orange is planned; the ramps end before either.

export const TYPES = [[0, 114, 178], [0, 158, 115], [86, 180, 233], [120, 94, 160], [150, 140, 60], [90, 110, 130]];
export const PLANNED = [230, 120, 20];
export const NOT_JUDGED = [150, 152, 156];
export const STRUCK = [120, 60, 60];
export const LOCKED = [150, 80, 10];
export const RAMP = [[0, 32, 81], [42, 63, 108], [97, 100, 112], [140, 137, 120], [188, 174, 108], [222, 208, 92]];
// Below the design (missing) to above it (too high): engineers read red as fill and blue as cut.
export const DIVERGING = [[33, 79, 138], [140, 175, 214], [247, 247, 247], [240, 160, 120], [170, 50, 30]];
// White, then darker the worse.
export const ERROR = [[236, 240, 232], [250, 214, 120], [236, 132, 60], [176, 40, 40], [90, 10, 50]];

export const mix = (stops, share) => {
  const v = Math.min(1, Math.max(0, share)) * (stops.length - 1), i = Math.min(Math.floor(v), stops.length - 2), f = v - i;
  return stops[i].map((c, k) => c * (1 - f) + stops[i + 1][k] * f);
};
export const css = (c, alpha = 1) => `rgba(${c.map(Math.round).join(",")},${alpha})`;
export const gradient = stops => `linear-gradient(90deg, ${stops.map(c => `rgb(${c})`).join(",")})`;
