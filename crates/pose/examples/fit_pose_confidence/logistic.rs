//! The weights that predict best which blocks are right, and how well others are predicted.

use pose::{AMONG_NAMES, NAMES, among_terms, speaks};
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

/// The two fitted files, fitted to both files: weights of a block's own features, and what the blocks around say. Each is also
/// predicted from the other alone: how well goes to the standard error.
pub fn fit(first: &str, second: &str) -> [String; 2] {
    let [first_rows, second_rows] = [first, second].map(|file| {
        let mut rows = read(file);
        rows.retain(|row| !row.condition.starts_with(OF_ANOTHER_SIZE));
        rows
    });
    let [one, two]: [Vec<&Row>; 2] = [&first_rows, &second_rows].map(|rows| rows.iter().collect());
    // What a block is by itself is predicted from the other seed, as it will be of surveys never seen.
    let [by_one, by_two] = [&one, &two].map(|rows| Weights::of(rows));
    let [around_one, around_two] = [(&one, &by_two), (&two, &by_one)].map(|(r, w)| around(r, w));
    let probabilities =
        |rows: &[Around], w: &Among| rows.iter().map(|r| w.probability(r)).collect::<Vec<_>>();
    tell(second, &two, &probabilities(&around_two, &Among::of(&around_one)));
    tell(first, &one, &probabilities(&around_one, &Among::of(&around_two)));
    let both: Vec<Around> = around_one.into_iter().chain(around_two).collect();
    let among = Among::of(&both).file(name(first), name(second));
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
    [file, among]
}

/// A block with what the others of its survey say of it.
struct Around<'a> {
    row: &'a Row,
    /// [`among_terms`], or the block's own logit alone where there is no other.
    x: [f64; AMONG_NAMES.len()],
    alone: bool,
}

/// Rows with the mean probability of the others of their survey.
fn around<'a>(rows: &[&'a Row], w: &Weights) -> Vec<Around<'a>> {
    let own: Vec<f64> = rows.iter().map(|row| w.probability(row)).collect();
    // Sum and number of those that speak; each of itself, too.
    let of_itself = |row: &Row, p: f64| match speaks(p as f32, row.flat) {
        true => (p, 1.0),
        false => (0.0, 0.0),
    };
    let mut surveys: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for (row, p) in rows.iter().zip(&own) {
        let (survey, own) = (surveys.entry(&row.condition).or_default(), of_itself(row, *p));
        *survey = (survey.0 + own.0, survey.1 + own.1);
    }
    let of = |(row, p): (&&'a Row, &f64)| {
        let (all, own) = (surveys[row.condition.as_str()], of_itself(row, *p));
        let (sum, count) = (all.0 - own.0, all.1 - own.1);
        let x = among_terms(*p as f32, (sum / count.max(1.0)) as f32).map(f64::from);
        Around { row, x, alone: count < 1.0 }
    };
    rows.iter().zip(&own).map(of).collect()
}

/// Weights of [`among_terms`] for both kinds of blocks.
struct Among {
    flat: Vec<f64>,
    other: Vec<f64>,
}

/// What is believed before there are data: the block is as sure as it is by itself. Pulls of the weights towards that.
const AS_ALONE: [f64; AMONG_NAMES.len()] = [0.0, 1.0, 0.0];
const AMONG_RIDGES: [f64; AMONG_NAMES.len()] = [0.1, 4.0, 0.1];
const AMONG_SIGNS: [f64; AMONG_NAMES.len()] = [0.0, 1.0, 1.0];

impl Among {
    fn of(rows: &[Around]) -> Self {
        let of = |flat: bool| {
            let rows: Vec<&Around> =
                rows.iter().filter(|r| r.row.flat == flat && !r.alone).collect();
            let counts = counts(&rows.iter().map(|r| r.row).collect::<Vec<_>>());
            let data: Vec<Datum> = rows
                .iter()
                .zip(counts)
                .map(|(r, count)| Datum { x: &r.x, right: r.row.right, count })
                .collect();
            descend(&data, &AMONG_RIDGES, &AS_ALONE, &AMONG_SIGNS)
        };
        Self { flat: of(true), other: of(false) }
    }

    fn probability(&self, row: &Around) -> f64 {
        let w = if row.row.flat { &self.flat } else { &self.other };
        probability(if row.alone { &AS_ALONE } else { w }, &row.x)
    }

    fn file(&self, first: &str, second: &str) -> String {
        let mut file = format!(
            "# What the blocks around a block say of it, made by `cargo xtask fit pose-confidence`: weights for blocks of flat faces, and for\n\
             # others. Fitted to the same blocks as confidence.txt, each by itself predicted from the other seed ({first} and {second}).\n"
        );
        for ((name, flat), other) in AMONG_NAMES.iter().zip(&self.flat).zip(&self.other) {
            file += &format!("{name} {flat:.3} {other:.3}\n");
        }
        file
    }
}

/// How well rows are predicted by weights that were fitted to others.
fn tell(file: &str, rows: &[&Row], predicted: &[f64]) {
    for (kind, of) in [("of flat faces", true), ("of others", false)] {
        let rows: Vec<(&Row, f64)> = rows
            .iter()
            .copied()
            .zip(predicted.iter().copied())
            .filter(|r| r.0.flat == of)
            .collect();
        eprintln!("{}: {} blocks {kind}, predicted from the other file", name(file), rows.len());
        for (low, high) in [(0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 0.99), (0.99, 1.01)] {
            let inside = rows.iter().filter(|r| (low..high).contains(&r.1));
            let (count, right) = inside.fold((0, 0), |(n, k), r| (n + 1, k + u32::from(r.0.right)));
            eprintln!("{low:.2} to {:.2}: {right} of {count} right", f64::min(high, 1.0));
        }
    }
    let mut wrong: BTreeMap<&str, (u32, u32)> = BTreeMap::new();
    for (row, &p) in rows.iter().zip(predicted) {
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

/// How much each row counts.
fn counts(rows: &[&Row]) -> Vec<f64> {
    let of_condition = of_condition(rows);
    rows.iter().map(|row| (MOST_OF_A_CONDITION / of_condition[condition(row)]).min(1.0)).collect()
}

/// Weights of a block's own features.
fn weights(rows: &[&Row], ridge: f64) -> Vec<f64> {
    let n = NAMES.len();
    let counts = counts(rows);
    // About their means features hardly move the constant.
    let total: f64 = counts.iter().sum();
    let mean = |i: usize| rows.iter().zip(&counts).map(|(r, c)| c * r.x[i]).sum::<f64>() / total;
    let means: Vec<f64> = (0..n).map(|i| if i == 0 { 0.0 } else { mean(i) }).collect();
    let spread = |i: usize| {
        let square = |(r, c): (&&Row, &f64)| c * (r.x[i] - means[i]).powi(2);
        (rows.iter().zip(&counts).map(square).sum::<f64>() / total).max(LEAST_SPREAD.powi(2))
    };
    let ridges: Vec<f64> = (0..n).map(|i| if i == 0 { 1e-3 } else { ridge * spread(i) }).collect();
    let about: Vec<Vec<f64>> =
        rows.iter().map(|r| r.x.iter().zip(&means).map(|(x, m)| x - m).collect()).collect();
    let data: Vec<Datum> = rows
        .iter()
        .zip(&about)
        .zip(counts)
        .map(|((row, x), count)| Datum { x, right: row.right, count })
        .collect();
    let mut w = descend(&data, &ridges, &vec![0.0; n], &SIGNS);
    w[0] -= w.iter().zip(&means).map(|(w, m)| w * m).sum::<f64>();
    w
}

/// What a regression sees of a row.
struct Datum<'a> {
    x: &'a [f64],
    right: bool,
    count: f64,
}

/// Logistic regression, one weight after the other by Newton's step, each pulled towards what is believed and kept on the side
/// its feature speaks for.
fn descend(data: &[Datum], ridges: &[f64], believed: &[f64], signs: &[f64]) -> Vec<f64> {
    let mut w = believed.to_vec();
    let mut z: Vec<f64> =
        data.iter().map(|d| d.x.iter().zip(&w).map(|(x, w)| x * w).sum()).collect();
    for _ in 0..ROUNDS {
        for i in 0..w.len() {
            let (mut slope, mut curve) = (-ridges[i] * (w[i] - believed[i]), ridges[i]);
            for (d, z) in data.iter().zip(&z) {
                let p = 1.0 / (1.0 + f64::exp(-z));
                slope += d.count * (f64::from(u8::from(d.right)) - p) * d.x[i];
                curve += d.count * p * (1.0 - p) * d.x[i] * d.x[i];
            }
            let mut next = w[i] + (slope / curve).clamp(-1.0, 1.0);
            if next * signs[i] < 0.0 {
                next = 0.0;
            }
            for (d, z) in data.iter().zip(&mut z) {
                *z += (next - w[i]) * d.x[i];
            }
            w[i] = next;
        }
    }
    w
}
