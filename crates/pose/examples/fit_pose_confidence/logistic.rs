//! The weights that predict best which blocks are right, and how well others are predicted.

use pose::NAMES;
use std::collections::BTreeMap;

/// A row of a features file.
struct Row {
    condition: String,
    right: bool,
    /// The block that was looked for has flat faces.
    flat: bool,
    x: Vec<f64>,
}

fn read(file: &str) -> Vec<Row> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{file}: {e}"));
    let row = |line: &str| {
        let part: Vec<&str> = line.split(',').collect();
        let x: Option<Vec<f64>> = part.get(5)?.split(' ').map(|v| v.parse().ok()).collect();
        let x = x.filter(|x| x.len() == NAMES.len())?;
        let [right, flat] = [1, 2].map(|i| part[i] == "1");
        Some(Row { condition: part[0].to_string(), right, flat, x })
    };
    text.lines().skip(1).filter(|l| !l.starts_with('#')).filter_map(row).collect()
}

/// A condition counts for as many blocks at most, so that no rich one drowns the others.
const MOST_OF_A_CONDITION: f64 = 25.0;
/// Blocks of another size than the catalogue's: all of them together tell that, not the features of one.
const OF_ANOTHER_SIZE: &str = "size-";
/// Pull of every weight towards 0, for a feature of unit spread: a feature that moves little needs a large weight to say as much.
/// Tried were 4 to 0.1. For flat faces no value predicts the other seed better; of others 4 is timid, and below 1 little is won.
const RIDGE_FLAT: f64 = 4.0;
const RIDGE_OTHER: f64 = 1.0;
/// Least spread of a feature: one that hardly ever moves is not believed at any price.
const LEAST_SPREAD: f64 = 0.02;
/// Features that can only speak for a block (+) or against it (−); their weights keep that sign.
const SIGNS: [f64; NAMES.len()] = [
    0.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0,
    1.0, 1.0, -1.0, -1.0,
];

/// The weights of both kinds of blocks. Those of flat faces are fitted to all rows, for land and stairs are full of flat faces and of
/// blocks of them alone there are few; those of other blocks to their own.
struct Weights {
    flat: Vec<f64>,
    other: Vec<f64>,
}

impl Weights {
    fn of(rows: &[&Row]) -> Self {
        let other: Vec<&Row> = rows.iter().filter(|r| !r.flat).copied().collect();
        Self { flat: weights(rows, RIDGE_FLAT), other: weights(&other, RIDGE_OTHER) }
    }

    fn probability(&self, row: &Row) -> f64 {
        probability(if row.flat { &self.flat } else { &self.other }, &row.x)
    }
}

/// The fitted file, fitted to both files. Each is also predicted from the other alone: how well goes to the standard error.
pub fn fit(first: &str, second: &str) -> String {
    let [first_rows, second_rows] = [first, second].map(|file| {
        let mut rows = read(file);
        rows.retain(|row| !row.condition.starts_with(OF_ANOTHER_SIZE));
        rows
    });
    let [one, two]: [Vec<&Row>; 2] = [&first_rows, &second_rows].map(|rows| rows.iter().collect());
    tell(second, &two, &Weights::of(&one));
    tell(first, &one, &Weights::of(&two));
    let rows: Vec<&Row> = one.into_iter().chain(two).collect();
    let of_condition = of_condition(&rows);
    let right = rows.iter().filter(|r| r.right).count();
    let flat = rows.iter().filter(|r| r.flat).count();
    let mut file = format!(
        "# Weights of the pose stage's confidence, made by `cargo xtask fit pose-confidence`: a feature a line, its weight for blocks\n\
         # of flat faces, and for others.\n\
         # Fitted to {} blocks of {} conditions, {right} of them right, {flat} of flat faces ({} and {}).\n",
        rows.len(),
        of_condition.len(),
        name(first),
        name(second)
    );
    let Weights { flat, other } = Weights::of(&rows);
    for ((name, flat), other) in NAMES.iter().zip(&flat).zip(&other) {
        file += &format!("{name} {flat:.3} {other:.3}\n");
    }
    file
}

/// How well rows are predicted by weights that were fitted to others.
fn tell(file: &str, rows: &[&Row], w: &Weights) {
    for (kind, of) in [("of flat faces", true), ("of others", false)] {
        let rows: Vec<&Row> = rows.iter().filter(|r| r.flat == of).copied().collect();
        eprintln!("{}: {} blocks {kind}, predicted from the other file", name(file), rows.len());
        for (low, high) in [(0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 0.99), (0.99, 1.01)] {
            let inside = rows.iter().filter(|r| (low..high).contains(&w.probability(r)));
            let (count, right) = inside.fold((0, 0), |(n, k), r| (n + 1, k + u32::from(r.right)));
            eprintln!("{low:.2} to {:.2}: {right} of {count} right", f64::min(high, 1.0));
        }
    }
    let mut wrong: BTreeMap<&str, (u32, u32)> = BTreeMap::new();
    for row in rows {
        let p = w.probability(row);
        let kind = wrong.entry(row.condition.split('/').next().unwrap_or("")).or_default();
        kind.0 += u32::from(!row.right && p >= 0.7);
        kind.1 += u32::from(row.right && p < 0.7);
    }
    eprintln!("stated wrong, right and not stated: {wrong:?}");
}

/// Rows of every condition.
fn of_condition<'a>(rows: &[&'a Row]) -> BTreeMap<&'a str, f64> {
    let mut of_condition: BTreeMap<&str, f64> = BTreeMap::new();
    for row in rows {
        *of_condition.entry(condition(row)).or_default() += 1.0;
    }
    of_condition
}

/// What a row counts with: surveys `…~1`, `…~2` and so on of a condition count together.
fn condition(row: &Row) -> &str {
    row.condition.split('~').next().unwrap_or(&row.condition)
}

pub fn name(file: &str) -> &str {
    std::path::Path::new(file).file_name().and_then(|n| n.to_str()).unwrap_or(file)
}

fn probability(w: &[f64], x: &[f64]) -> f64 {
    let z: f64 = w.iter().zip(x).map(|(w, x)| w * x).sum();
    1.0 / (1.0 + (-z).exp())
}

/// Rounds over all weights.
const ROUNDS: usize = 3000;

/// Logistic regression, one weight after the other by Newton's step, each kept on the side its feature speaks for.
fn weights(rows: &[&Row], ridge: f64) -> Vec<f64> {
    let n = NAMES.len();
    let of_condition = of_condition(rows);
    let count = |row: &Row| (MOST_OF_A_CONDITION / of_condition[condition(row)]).min(1.0);
    let counts: Vec<f64> = rows.iter().map(|row| count(row)).collect();
    // About their means features hardly move the constant.
    let total: f64 = counts.iter().sum();
    let mean = |i: usize| rows.iter().zip(&counts).map(|(r, c)| c * r.x[i]).sum::<f64>() / total;
    let means: Vec<f64> = (0..n).map(|i| if i == 0 { 0.0 } else { mean(i) }).collect();
    let spread = |i: usize| {
        let square = |(r, c): (&&Row, &f64)| c * (r.x[i] - means[i]).powi(2);
        (rows.iter().zip(&counts).map(square).sum::<f64>() / total).max(LEAST_SPREAD.powi(2))
    };
    let ridges: Vec<f64> = (0..n).map(|i| if i == 0 { 1e-3 } else { ridge * spread(i) }).collect();
    let mut w = vec![0.0; n];
    let mut z = vec![0.0; rows.len()];
    for _ in 0..ROUNDS {
        for i in 0..n {
            let ridge = ridges[i];
            let (mut slope, mut curve) = (-ridge * w[i], ridge);
            for ((row, c), z) in rows.iter().zip(&counts).zip(&z) {
                let p = 1.0 / (1.0 + f64::exp(-z));
                let x = row.x[i] - means[i];
                slope += c * (f64::from(u8::from(row.right)) - p) * x;
                curve += c * p * (1.0 - p) * x * x;
            }
            let mut next = w[i] + (slope / curve).clamp(-1.0, 1.0);
            if next * SIGNS[i] < 0.0 {
                next = 0.0;
            }
            for (row, z) in rows.iter().zip(&mut z) {
                *z += (next - w[i]) * (row.x[i] - means[i]);
            }
            w[i] = next;
        }
    }
    w[0] -= w.iter().zip(&means).map(|(w, m)| w * m).sum::<f64>();
    w
}
