//! Does the search learn from a foreman? Simulated foremen of hidden weights choose between places of a pile's windows; how often the
//! learned weights agree with them on other windows, and what Thompson sampling loses while it learns.

use crate::planning_site::{Span, mean_and_spread, settings};
use crate::{Bench, Experiment, ReproduceError, Table};
use geom::SeedTree;
use plan::{
    Candidate, Learned, Opinion, Policy, SearchConfig, SignWeights, Signs, learn, most_telling,
};
use rand::{Rng, RngExt};
use std::fmt::Write;

pub const EXPERIMENT: Experiment = Experiment {
    name: "planning-ratings",
    about: "weights learned from simulated foremen: agreement and regret",
    body,
};

/// Windows of the pile; every second one is held out.
const WINDOWS: usize = 80;
/// Comparisons after which agreement is measured.
const AFTER: [usize; 4] = [0, 10, 20, 40];
/// Windows looked at for the next pair.
const LOOKED_AT: usize = 8;
/// How decided a foreman is: log odds of one block length of cost.
const DECIDED: f32 = 10.0;
/// Windows served while learning.
const SERVED: usize = 120;

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let span = Span::new(bench)?;
    let seed = SeedTree::new(bench.settings.seed).child("ratings", 0);
    let config = settings(Policy::Search);
    let windows = plan::stable_places(&span.input(), &config, WINDOWS, seed, bench.observer)?;
    let windows: Vec<Vec<Candidate>> = windows.into_iter().filter(|w| w.len() > 1).collect();
    let (asked, held_out): (Vec<_>, Vec<_>) =
        windows.into_iter().enumerate().partition(|(i, _)| i % 2 == 0);
    let of = |list: Vec<(usize, Vec<Candidate>)>| -> Vec<Vec<Candidate>> {
        list.into_iter().map(|(_, w)| w).collect()
    };
    let (asked, held_out) = (of(asked), of(held_out));
    let foremen = 4 * bench.settings.repeats;
    let mut agreements: Vec<[[f64; AFTER.len()]; 2]> = Vec::new();
    let mut regrets: Vec<[f64; 3]> = Vec::new();
    for number in 0..foremen {
        if bench.observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        let seed = seed.child("foreman", number);
        let foreman = hidden(&mut seed.rng());
        let course = |telling| agreement(&foreman, &asked, &held_out, telling, seed);
        agreements.push([course(true), course(false)]);
        regrets.push(regret(&foreman, &asked, seed.child("regret", 0)));
    }
    let mut text = format!(
        "{} {foremen} foremen; {} windows to ask about, {} held out. A foreman has hidden weights: today's times a log-normal factor of 0.8, and some dislike \
         of missing contacts, wedging and distance; he answers with P = σ({DECIDED} × difference of cost). Agreement: part of all pairs of places of a held-out window that \
         the learned weights order as he does.\n\n",
        span.words(),
        asked.len(),
        held_out.len()
    );
    write!(text, "{}\n{}", agreement_table(&agreements), regret_table(&regrets))
        .expect("a string takes all text");
    Ok(text)
}

fn today() -> SignWeights {
    SignWeights::today(&SearchConfig::default())
}

/// What a foreman goes by.
fn hidden(rng: &mut impl Rng) -> SignWeights {
    // Sum of uniform numbers: near enough to a normal one.
    let mut normal = || (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
    let w = today();
    SignWeights {
        above: w.above * (0.8 * normal()).exp(),
        raised: w.raised * (0.8 * normal()).exp(),
        protruding: w.protruding * (0.8 * normal()).exp(),
        loose: 0.8 * normal().abs(),
        wedged: 2.0 * normal().abs(),
        far: 0.0,
    }
}

/// Which of two he would build.
fn opinion(foreman: &SignWeights, a: &Signs, b: &Signs, rng: &mut impl Rng) -> Opinion {
    let odds = DECIDED * (foreman.cost(b) - foreman.cost(a));
    let a_is_better = rng.random::<f32>() < 1.0 / (1.0 + (-odds).exp());
    let (better, worse) = if a_is_better { (*a, *b) } else { (*b, *a) };
    Opinion::Pair { better, worse }
}

/// Agreement on the held-out windows after so many comparisons, of telling pairs or of any.
fn agreement(
    foreman: &SignWeights,
    asked: &[Vec<Candidate>],
    held_out: &[Vec<Candidate>],
    telling: bool,
    seed: SeedTree,
) -> [f64; AFTER.len()] {
    let mut rng = seed.child(if telling { "telling" } else { "any" }, 0).rng();
    let mut opinions: Vec<Opinion> = Vec::new();
    let mut learned = learn(&opinions, today());
    AFTER.map(|after| {
        while opinions.len() < after {
            let (a, b) = pair(asked, &learned, telling, &mut rng);
            opinions.push(opinion(foreman, &a, &b, &mut rng));
            learned = learn(&opinions, today());
        }
        agrees(foreman, &learned.weights, held_out)
    })
}

fn pair(
    asked: &[Vec<Candidate>],
    learned: &Learned,
    telling: bool,
    rng: &mut impl Rng,
) -> (Signs, Signs) {
    let window = |rng: &mut dyn FnMut() -> usize| &asked[rng() % asked.len()];
    let mut next = || rng.random::<u32>() as usize;
    if telling {
        let best = (0..LOOKED_AT)
            .filter_map(|_| most_telling(window(&mut next), learned))
            .max_by(|x, y| x.information.total_cmp(&y.information));
        let best = best.expect("every window has two places");
        return (best.a.signs, best.b.signs);
    }
    let places = window(&mut next);
    let (i, step) = (next() % places.len(), 1 + next() % (places.len() - 1));
    (places[i].signs, places[(i + step) % places.len()].signs)
}

fn agrees(foreman: &SignWeights, weights: &SignWeights, windows: &[Vec<Candidate>]) -> f64 {
    let (mut right, mut all) = (0, 0);
    for places in windows {
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                let better = |w: &SignWeights| w.cost(&a.signs) < w.cost(&b.signs);
                right += u32::from(better(foreman) == better(weights));
                all += 1;
            }
        }
    }
    f64::from(right) / f64::from(all.max(1))
}

/// Cost above the best place a window has, summed over the windows served: of today's choice, of Thompson sampling, and of the
/// mean weights learned on the way.
fn regret(foreman: &SignWeights, windows: &[Vec<Candidate>], seed: SeedTree) -> [f64; 3] {
    let mut rng = seed.rng();
    let mut opinions: Vec<Opinion> = Vec::new();
    let mut learned = learn(&opinions, today());
    let mut lost = [0.0; 3];
    for served in 0..SERVED {
        let places = &windows[served % windows.len()];
        let least = places.iter().map(|c| foreman.cost(&c.signs)).fold(f32::INFINITY, f32::min);
        let choice = |weights: &Signs| {
            let cost =
                |c: &&Candidate| -> f32 { c.signs.iter().zip(weights).map(|(s, w)| s * w).sum() };
            places.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("no window is empty")
        };
        let drawn = choice(&learned.drawn(&mut rng));
        let chosen = [choice(&today().to_array()), drawn, choice(&learned.weights.to_array())];
        for (lost, c) in lost.iter_mut().zip(chosen) {
            *lost += f64::from(foreman.cost(&c.signs) - least);
        }
        // The foreman compares the drawn choice with the one of the mean.
        if drawn.signs != chosen[2].signs {
            opinions.push(opinion(foreman, &drawn.signs, &chosen[2].signs, &mut rng));
            learned = learn(&opinions, today());
        }
    }
    lost
}

fn agreement_table(agreements: &[[[f64; AFTER.len()]; 2]]) -> String {
    let mut table = Table::new(&["pairs asked", "before", "after 10", "after 20", "after 40"]);
    for (k, name) in ["most telling", "any"].into_iter().enumerate() {
        let cell = |at: usize| {
            let values: Vec<f64> = agreements.iter().map(|a| 100.0 * a[k][at]).collect();
            let (mean, spread) = mean_and_spread(&values);
            format!("{mean:.1} ± {spread:.1} %")
        };
        table.row([name.to_string(), cell(0), cell(1), cell(2), cell(3)]);
    }
    table.finish()
}

fn regret_table(regrets: &[[f64; 3]]) -> String {
    let mut table = Table::new(&["choice", "regret of a window, block lengths of cost"]);
    for (k, name) in
        ["today's weights", "Thompson sampling", "mean of what was learned"].into_iter().enumerate()
    {
        let values: Vec<f64> = regrets.iter().map(|r| r[k] / SERVED as f64).collect();
        let (mean, spread) = mean_and_spread(&values);
        table.row([name.to_string(), format!("{mean:.4} ± {spread:.4}")]);
    }
    table.finish()
}
