//! `ratings.json` of a site: checked, turned into opinions, learned from; the weights that moved, as a table.

use crate::error::OrBadInput;
use crate::{Error, Result, Site, outputs};
use anyhow::anyhow;
use geom::{Event, Observer, Stage, Warning};
use plan::{Learned, MovedWeight, Opinion, SignWeights, Signs};
use scene::{Better, BlockRating, Catalog, RatedPlace, Ratings, SIGNS};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A sign beyond this is none of a block at rest.
const LARGEST_SIGN: f64 = 100.0;
/// Places of the same person nearer than this are one block, metres: files keep millimetres.
const SAME_PLACE_M: f64 = 0.01;
/// Rated blocks farther from the design than this, in block lengths, are of other works.
const ELSEWHERE: f64 = 10.0;

/// What was learned; `notes.ratings` of a manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RatingsRecord {
    /// Ratings of blocks and choices of pairs by each person.
    pub by: BTreeMap<String, [usize; 2]>,
    /// Each weight before and after.
    pub weights: Vec<WeightRecord>,
}

/// One weight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeightRecord {
    /// Its sign.
    pub sign: String,
    /// Before any rating.
    pub today: f32,
    /// After.
    pub learned: f32,
    /// Standard deviation of it.
    pub sd: f32,
    /// Ratings that made it larger.
    pub raised_by: u32,
    /// Ratings that made it smaller.
    pub lowered_by: u32,
}

impl RatingsRecord {
    /// In words: how much was said by how many, and which weights moved.
    pub fn line(&self) -> String {
        let count = |k: usize| self.by.values().map(|n| n[k]).sum::<usize>();
        let moved = |w: &&WeightRecord| (w.learned - w.today).abs() >= 0.05 * w.today.max(0.5);
        let word = |w: &WeightRecord| {
            format!("{} {:.2} → {:.2} ± {:.2}", w.sign, w.today, w.learned, w.sd)
        };
        let moved: Vec<String> = self.weights.iter().filter(moved).map(word).collect();
        let moved = if moved.is_empty() { "none moved".into() } else { moved.join(", ") };
        format!(
            "{} ratings and {} choices by {} ({}): weights of the search: {moved}",
            count(0),
            count(1),
            self.by.keys().map(String::as_str).collect::<Vec<_>>().join(", "),
            io::ratings::FILE
        )
    }
}

fn record_of(ratings: &Ratings, moved: &[MovedWeight]) -> RatingsRecord {
    let mut by: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    let name = |by: &str| if by.trim().is_empty() { "unnamed".into() } else { by.to_string() };
    ratings.blocks.iter().for_each(|b| by.entry(name(&b.by)).or_default()[0] += 1);
    ratings.pairs.iter().for_each(|p| by.entry(name(&p.by)).or_default()[1] += 1);
    let weight = |m: &MovedWeight| WeightRecord {
        sign: m.sign.into(),
        today: m.today,
        learned: m.learned,
        sd: m.sd,
        raised_by: m.raised_by,
        lowered_by: m.lowered_by,
    };
    RatingsRecord { by, weights: moved.iter().map(weight).collect() }
}

/// Reads the ratings of a site folder, if there are any.
pub(crate) fn read(folder: &Path) -> Result<Option<Ratings>> {
    io::ratings::read(&folder.join(io::ratings::FILE)).or_bad_input()
}

impl Site {
    /// Lets the search rank places as the people think who rated its plans. Weights stated in the settings stay as they are.
    pub(crate) fn learn(&mut self, observer: &dyn Observer) -> Result<()> {
        let Some(ratings) = self.ratings.take() else { return Ok(()) };
        self.check_ratings(&ratings)?;
        let said = without_contradictions(&ratings, observer);
        if self.config.plan.search.weights.is_none()
            && !(said.blocks.is_empty() && said.pairs.is_empty())
        {
            let learned = learned(Some(&said), SignWeights::today(&self.config.plan.search));
            self.config.plan.search.weights = Some(learned.weights);
            let record = record_of(&said, &learned.moved);
            observer.event(Event::Noted { stage: Stage::Ratings, message: record.line() });
            self.learned = Some(record);
        }
        self.ratings = Some(said);
        Ok(())
    }

    /// What is known of the weights, for choosing what to ask next.
    pub(crate) fn posterior(&self) -> Learned {
        let plain = plan::SearchConfig { weights: None, ..self.config.plan.search.clone() };
        learned(self.ratings.as_ref(), SignWeights::today(&plain))
    }

    /// Refuses ratings of another site, of types there are none of, of blocks that cannot be.
    fn check_ratings(&self, ratings: &Ratings) -> Result<()> {
        let bad = |what: String| {
            let file = self.folder.as_deref().unwrap_or(Path::new("")).join(io::ratings::FILE);
            Error::bad_input(anyhow!("{}: {what}", file.display()))
        };
        if ratings.site != self.name {
            return Err(bad(format!(
                "rates a plan of \"{}\", this site is \"{}\"; take the file out, or save the ratings from this site's report",
                ratings.site, self.name
            )));
        }
        let blocks = ratings.blocks.iter().map(|b| (format!("block {}", b.order), &b.place));
        let pairs = ratings.pairs.iter().flat_map(|p| {
            [(format!("pair {}, a", p.pair), &p.a), (format!("pair {}, b", p.pair), &p.b)]
        });
        for (name, place) in blocks.chain(pairs) {
            self.place_objection(place)
                .map_or(Ok(()), |what| Err(bad(format!("{name}: {what}"))))?;
        }
        Ok(())
    }

    fn place_objection(&self, place: &RatedPlace) -> Option<String> {
        if self.catalog.find(&place.model).is_none() {
            let known = names(&self.catalog);
            return Some(format!("is a \"{}\", the catalogue has {known}", place.model));
        }
        if let Some(i) = place.signs.iter().position(|s| !(s.abs() <= LARGEST_SIGN)) {
            let (sign, value) = (SIGNS[i], place.signs[i]);
            return Some(format!(
                "sign {sign} = {value} is none of a block at rest; rate it again in the report"
            ));
        }
        let [low, high] = self.design.as_ref()?.extent();
        let beyond = |v: f64, k: usize| (low[k] - v).max(v - high[k]).max(0.0);
        let away_m = beyond(place.x_m, 0).hypot(beyond(place.y_m, 1));
        let far = !(away_m <= ELSEWHERE * f64::from(self.catalog.d_max_m()));
        far.then(|| {
            format!("lies {away_m:.0} m away from the design: it is a block of other works")
        })
    }
}

fn names(catalog: &Catalog) -> String {
    catalog.iter().map(|(_, m)| m.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Opinions without those that the same person replaced by a later one; says which.
fn without_contradictions(ratings: &Ratings, observer: &dyn Observer) -> Ratings {
    let same = |a: &RatedPlace, b: &RatedPlace| {
        a.model == b.model
            && (a.x_m - b.x_m).hypot(a.y_m - b.y_m).hypot(a.z_m - b.z_m) < SAME_PLACE_M
    };
    let mut said = Ratings { blocks: Vec::new(), pairs: Vec::new(), ..ratings.clone() };
    let mut replaced: Vec<String> = Vec::new();
    for b in &ratings.blocks {
        let other = said.blocks.iter().position(|o| o.by == b.by && same(&o.place, &b.place));
        let Some(at) = other else {
            said.blocks.push(b.clone());
            continue;
        };
        if said.blocks[at].rating != b.rating {
            replaced.push(format!("block {} by {}", b.order, b.by));
        }
        if b.when >= said.blocks[at].when {
            said.blocks[at] = b.clone();
        }
    }
    for p in &ratings.pairs {
        let straight = |o: &scene::RatedPair| same(&o.a, &p.a) && same(&o.b, &p.b);
        let crossed = |o: &scene::RatedPair| same(&o.a, &p.b) && same(&o.b, &p.a);
        let other = said.pairs.iter().position(|o| o.by == p.by && (straight(o) || crossed(o)));
        let Some(at) = other else {
            said.pairs.push(p.clone());
            continue;
        };
        let o = &said.pairs[at];
        if (o.better == p.better) == crossed(o) {
            replaced.push(format!("pair {} by {}", p.pair, p.by));
        }
        if p.when >= o.when {
            said.pairs[at] = p.clone();
        }
    }
    if !replaced.is_empty() {
        let message =
            format!("contradictory ratings: {}; of each the latest counts", replaced.join(", "));
        observer.event(Event::Warned(Warning { stage: Stage::Ratings, message }));
    }
    said
}

fn learned(ratings: Option<&Ratings>, today: SignWeights) -> Learned {
    let signs = |p: &RatedPlace| -> Signs { p.signs.map(|s| s as f32) };
    let Some(ratings) = ratings else { return plan::learn(&[], today) };
    let single = ratings
        .blocks
        .iter()
        .map(|b| Opinion::Single { signs: signs(&b.place), good: BlockRating::is_good(b.rating) });
    let pairs = ratings.pairs.iter().map(|p| match p.better {
        Better::A => Opinion::Pair { better: signs(&p.a), worse: signs(&p.b) },
        Better::B => Opinion::Pair { better: signs(&p.b), worse: signs(&p.a) },
    });
    plan::learn(&single.chain(pairs).collect::<Vec<_>>(), today)
}

/// Writes `plan/weights.json`: what was learned from whom.
pub(crate) fn write(path: &Path, record: &RatingsRecord) -> Result<()> {
    outputs::write_json(path, record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::RatedBlock;
    use std::sync::Mutex;

    struct Heard(Mutex<Vec<String>>);

    impl Observer for Heard {
        fn event(&self, event: Event) {
            if let Event::Warned(w) = event {
                self.0.lock().unwrap().push(w.message);
            }
        }
    }

    fn block(by: &str, when: &str, x_m: f64, rating: BlockRating) -> RatedBlock {
        let place = RatedPlace { model: "t".into(), x_m, y_m: 0.0, z_m: 0.0, signs: [0.0; 6] };
        RatedBlock { by: by.into(), when: when.into(), order: 1, rating, place }
    }

    #[test]
    fn of_contradictory_ratings_the_latest_counts_and_people_may_differ() {
        let blocks = vec![
            block("A", "2026-11-02", 0.0, BlockRating::Good),
            block("A", "2026-11-01", 0.0, BlockRating::Loose),
            block("B", "2026-11-01", 0.0, BlockRating::Loose),
            block("A", "2026-11-01", 5.0, BlockRating::Good),
        ];
        let ratings = Ratings { format: 1, site: "s".into(), blocks, pairs: Vec::new() };
        let heard = Heard(Mutex::default());
        let said = without_contradictions(&ratings, &heard);
        assert_eq!(said.blocks.len(), 3);
        assert_eq!(said.blocks[0].rating, BlockRating::Good);
        let heard = heard.0.into_inner().unwrap();
        assert!(heard.len() == 1 && heard[0].contains("block 1 by A"), "{heard:?}");
    }
}
