//! Survey lines laid onto each other before anything is searched.
//!
//! In: points with the number of the line (pass) each was measured on. Out: where the points lie once every line is
//! moved by a shift of its own. A boat's position and heave err by centimetres from line to line, the same for all
//! points of a line; where several lines measured one surface these errors show, and are the larger part of what
//! looks like noise. What all lines err in common nobody can see: the shifts' mean over the lines is zero, which is
//! the best guess when lines err alike.
//!
//! One least-squares problem a round: at places spread over the survey, the mean height of every line's points above the
//! local surface is the place's own unknown plus the line's shift along the normal. The place's unknown is eliminated,
//! the lines' shifts are solved together; outliers lose their say from round to round.

use geom::thin_from_lowest;
use geom::{PointGrid, Vec3};
use rayon::prelude::*;

/// What levelling found.
#[derive(Clone, Debug)]
pub struct Levelled {
    /// The points with their lines' shifts taken out.
    pub position: Vec<Vec3>,
    /// How far one line's points scatter about the local surface afterwards: a robust standard deviation, metres.
    pub scatter_m: f32,
    /// How many lines were moved.
    pub lines: usize,
    /// Root mean square of the shifts taken out, metres.
    pub shift_m: f32,
    /// The shift taken out of each line, by the line's number.
    pub shifts: Vec<(u16, Vec3)>,
}

/// Lines with fewer points keep their place.
const FEWEST_POINTS: usize = 300;
/// More lines than this are no passes of one survey (tiles, flight strips of a region).
const MOST_LINES: usize = 64;
/// Fewest points of a line at a place.
const FEWEST_AT_A_PLACE: f32 = 3.0;
/// How far lines err before anything is known, metres; keeps directions nobody measured still.
const PRIOR_SD_M: f32 = 0.05;
/// Errors of a line's mean at a place that more points do not lessen (footprint, roughness), metres.
const COMMON_SD_M: f32 = 0.01;
const ROUNDS: usize = 4;

/// Moves every line by one shift; `None` when there are no lines to move.
pub fn level(position: &[Vec3], line: &[u16], d_max_m: f32, noise_sd_m: f32) -> Option<Levelled> {
    if line.len() != position.len() {
        return None;
    }
    let (entry, numbers) = entries(line)?;
    let lines = numbers.len();
    let mut shift = vec![Vec3::ZERO; lines];
    let mut moved = position.to_vec();
    let mut scatter_m = noise_sd_m;
    for round in 0..ROUNDS {
        let (step, scatter) = step(
            &moved,
            &entry,
            lines,
            d_max_m,
            scatter_m.max(0.2 * noise_sd_m),
            round == 0,
            noise_sd_m,
        );
        scatter_m = scatter.clamp(0.1 * noise_sd_m, noise_sd_m);
        let mut largest = 0.0_f32;
        for (s, d) in shift.iter_mut().zip(&step) {
            *s += *d;
            largest = largest.max(d.length());
        }
        for ((m, p), e) in moved.iter_mut().zip(position).zip(&entry) {
            if let Some(e) = e {
                *m = *p - shift[*e as usize];
            }
        }
        if largest < 1e-4 {
            break;
        }
    }
    let shift_m = (shift.iter().map(|s| s.length_squared()).sum::<f32>() / lines as f32).sqrt();
    let shifts = numbers.into_iter().zip(shift).collect();
    Some(Levelled { position: moved, scatter_m, lines, shift_m, shifts })
}

/// Entry of every point's line in the list of lines that are moved (`None` for points of no line or a short one), and the
/// numbers of those lines.
fn entries(line: &[u16]) -> Option<(Vec<Option<u16>>, Vec<u16>)> {
    let mut count = vec![0_usize; usize::from(u16::MAX) + 1];
    for &l in line {
        count[usize::from(l)] += 1;
    }
    let numbers: Vec<usize> = (1..count.len()).filter(|&l| count[l] >= FEWEST_POINTS).collect();
    if !(2..=MOST_LINES).contains(&numbers.len()) {
        return None;
    }
    let mut entry_of = vec![None; count.len()];
    for (entry, &number) in numbers.iter().enumerate() {
        entry_of[number] = Some(entry as u16);
    }
    let entry = line.iter().map(|&l| entry_of[usize::from(l)]).collect();
    Some((entry, numbers.into_iter().map(|l| l as u16).collect()))
}

/// What a place says: the normal, and of every line there its entry, mean height and weight.
struct Place {
    normal: Vec3,
    line: Vec<(u16, f32, f32)>,
    /// Squared scatter of points about their own line's mean.
    scatter_m2: f32,
}

/// The shifts that lay the lines onto each other best, and the scatter about them.
fn step(
    position: &[Vec3],
    entry: &[Option<u16>],
    lines: usize,
    d_max_m: f32,
    sd_m: f32,
    first: bool,
    noise_sd_m: f32,
) -> (Vec<Vec3>, f32) {
    let radius_m = (0.16 * d_max_m).max(3.0 * sd_m);
    let normal = geom::normals(position, radius_m, &|_| Vec3::Z);
    // Lines may lie several standard deviations apart before the first round.
    let gate_m = if first { 5.0 * noise_sd_m } else { 4.0 * sd_m + 0.5 * noise_sd_m };
    let round =
        Round { grid: PointGrid::new(position, radius_m), entry, lines, radius_m, gate_m, sd_m };
    let sites = thin_from_lowest(position, radius_m).kept;
    let places: Vec<Place> = sites
        .par_iter()
        .filter_map(|&i| round.place(position[i as usize], normal[i as usize]))
        .collect();
    let unknowns = 3 * lines;
    let mut a = vec![0.0_f64; unknowns * unknowns];
    let mut b = vec![0.0_f64; unknowns];
    for place in &places {
        let total: f32 = place.line.iter().map(|l| l.2).sum();
        let mean = place.line.iter().map(|l| l.1 * l.2).sum::<f32>() / total;
        for &(l, height, weight) in &place.line {
            // Geman and McClure: places where lines saw different surfaces lose their say.
            let off = (height - mean) / (3.0 * sd_m).max(COMMON_SD_M);
            let keep = if first { 1.0 } else { (1.0 + off * off).powi(-2) };
            for axis in 0..3 {
                let row = 3 * usize::from(l) + axis;
                b[row] += f64::from(keep * weight * (height - mean) * place.normal[axis]);
                for &(k, _, other) in &place.line {
                    // Derivative of (height − mean) by the shift of line k.
                    let share = f32::from(u8::from(k == l)) - other / total;
                    for along in 0..3 {
                        a[row * unknowns + 3 * usize::from(k) + along] += f64::from(
                            keep * weight * share * place.normal[axis] * place.normal[along],
                        );
                    }
                }
            }
        }
    }
    for i in 0..unknowns {
        a[i * unknowns + i] += f64::from(PRIOR_SD_M).powi(-2);
    }
    let solved = solve(&mut a, b, unknowns);
    let mut step: Vec<Vec3> =
        solved.chunks_exact(3).map(|s| Vec3::new(s[0] as f32, s[1] as f32, s[2] as f32)).collect();
    let mean = step.iter().copied().sum::<Vec3>() / lines as f32;
    step.iter_mut().for_each(|s| *s -= mean);
    let mut scatter: Vec<f32> = places.iter().map(|p| p.scatter_m2).collect();
    scatter.sort_by(f32::total_cmp);
    let scatter_m = scatter.get(scatter.len() / 2).map_or(noise_sd_m, |s| s.sqrt());
    (step, scatter_m)
}

/// The survey as one round sees it.
struct Round<'a> {
    grid: PointGrid,
    /// Line of each point.
    entry: &'a [Option<u16>],
    lines: usize,
    /// Points this near belong to a place.
    radius_m: f32,
    /// Points further from the local surface are left out.
    gate_m: f32,
    /// Scatter of one point about the surface.
    sd_m: f32,
}

impl Round<'_> {
    /// What the lines say at a point; `None` where fewer than two measured or there is no normal.
    fn place(&self, at: Vec3, normal: Vec3) -> Option<Place> {
        if normal == Vec3::ZERO {
            return None;
        }
        let mut sum = vec![(0.0_f32, 0.0_f32, 0.0_f32); self.lines];
        self.grid.for_each_within(at, self.radius_m, |i, p, _| {
            let height = normal.dot(p - at);
            if let (true, Some(e)) = (height.abs() < self.gate_m, self.entry[i as usize]) {
                let s = &mut sum[usize::from(e)];
                *s = (s.0 + 1.0, s.1 + height, s.2 + height * height);
            }
        });
        let mut line = Vec::new();
        let (mut spread, mut count) = (0.0, 0.0);
        for (e, &(n, h, h2)) in sum.iter().enumerate() {
            if n >= FEWEST_AT_A_PLACE {
                let variance = self.sd_m * self.sd_m / n + COMMON_SD_M * COMMON_SD_M;
                line.push((e as u16, h / n, variance.recip()));
                spread += (h2 - h * h / n).max(0.0);
                count += n - 1.0;
            }
        }
        (line.len() >= 2).then(|| Place { normal, line, scatter_m2: spread / count })
    }
}

/// Gaussian elimination with the largest pivot; the prior keeps the matrix regular.
pub fn solve(a: &mut [f64], mut b: Vec<f64>, n: usize) -> Vec<f64> {
    for k in 0..n {
        let pivot =
            (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs())).unwrap_or(k);
        for c in 0..n {
            a.swap(k * n + c, pivot * n + c);
        }
        b.swap(k, pivot);
        for r in k + 1..n {
            let factor = a[r * n + k] / a[k * n + k];
            if factor != 0.0 {
                for c in k..n {
                    a[r * n + c] -= factor * a[k * n + c];
                }
                b[r] -= factor * b[k];
            }
        }
    }
    for k in (0..n).rev() {
        for c in k + 1..n {
            b[k] -= a[k * n + c] * b[c];
        }
        b[k] /= a[k * n + k];
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner of three faces, measured on three lines.
    fn corner(shift: [Vec3; 3]) -> (Vec<Vec3>, Vec<u16>) {
        let (mut position, mut line) = (Vec::new(), Vec::new());
        for i in 0..9000_u32 {
            let r = |k: f64| (f64::from(i) * k).fract() as f32 * 2.0;
            let (u, v, w) = (r(0.754_877_666), r(0.569_840_291), r(0.362_437_1) * 0.01);
            let p =
                [Vec3::new(u, v, w), Vec3::new(u, w, v), Vec3::new(w, u, v)][i as usize / 3 % 3];
            position.push(p + shift[i as usize % 3]);
            line.push(i as u16 % 3 + 7);
        }
        (position, line)
    }

    #[test]
    fn lines_come_back_onto_each_other() {
        let shift = [
            Vec3::new(0.03, -0.02, 0.02),
            Vec3::new(-0.04, 0.01, 0.0),
            Vec3::new(0.01, 0.01, -0.02),
        ];
        let (position, line) = corner(shift);
        let (truth, _) = corner([Vec3::ZERO; 3]);
        let levelled = level(&position, &line, 1.2, 0.03).unwrap();
        let worst = levelled
            .position
            .iter()
            .zip(&truth)
            .map(|(a, b)| (*a - *b).length())
            .fold(0.0, f32::max);
        assert!(worst < 0.004, "{worst}");
        assert!(levelled.scatter_m < 0.012, "{}", levelled.scatter_m);
        assert_eq!(levelled.lines, 3);
    }

    #[test]
    fn one_line_or_none_is_left_alone() {
        let (position, line) = corner([Vec3::ZERO; 3]);
        assert!(level(&position, &vec![4; line.len()], 1.2, 0.03).is_none());
        assert!(level(&position, &[], 1.2, 0.03).is_none());
    }
}
