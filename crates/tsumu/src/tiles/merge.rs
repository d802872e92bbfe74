//! From the results of all tiles to the recognition of the whole.
//!
//! A block is the tile's whose core its centre lies in. What two tiles see of one block differs by millimetres, so that near a seam both
//! or neither could call it theirs: tiles tell of blocks a little beyond their core, the same block told of twice becomes one, and the
//! mean of its places decides whose it is. Numbers follow the blocks' places in the world, so that they are the same however the works
//! were cut and in whatever order the tiles were done.

use super::plan::TilePlan;
use super::work::{Claim, Done, TileResult};
use crate::recognition::{Recognition, Segments};
use crate::{Error, Job, Result, Site, review};
use geom::{Event, Observer, Stage, Vec3, Warning};
use pipeline::PileVerdict;
use scene::{Catalog, Guess, InstanceId, PoseLimits, Recognised, Verdict};
use std::collections::{BTreeMap, BTreeSet};

/// At most so many tiles are named in a message.
const NAMED: usize = 5;

/// A claim and the tile it comes from.
struct Told {
    tile: usize,
    claim: Claim,
}

impl TilePlan {
    /// The recognition of the whole from the results of all tiles. `site` is the plan's. Errors: tiles are missing, or were worked on for
    /// another plan or by another program, or the site's files have changed: all of it is named, and nothing is merged.
    pub(crate) fn recognition(&self, site: &Site, job: &Job) -> Result<Recognition> {
        self.is_of(site)?;
        let done = self.all_done(job)?;
        let mut labels = Labels::new(self, site.survey.cloud.len());
        let mut told = Vec::new();
        let mut pile = PileVerdict {
            size: self.facts().size,
            mirrored: self.facts().mirrored,
            viewpoint: self.facts().viewpoint.clone(),
            ..PileVerdict::default()
        };
        let (mut standing, mut explained, mut hypotheses) = (0, 0, 0);
        for (tile, (key, done)) in done.iter().enumerate() {
            let result = self.result(key, done)?;
            standing += result.standing;
            explained += result.explained;
            hypotheses += result.hypotheses;
            pile.not_a_block += result.not_a_block;
            let TileResult { claims, instances, .. } = result;
            told.extend(claims.into_iter().map(|claim| Told { tile, claim }));
            instances.iter().for_each(|i| labels.add(&i.points, &i.confidence));
        }
        let mut blocks = self.blocks(told, site, &mut labels);
        pile.stated = scene::stated(&blocks).count();
        pile.explained = explained as f32 / (standing as f32).max(1.0);
        for message in pile.warnings() {
            job.event(Event::Warned(Warning { stage: Stage::Pose, message }));
        }
        let (catalog, frame) = (&site.catalog, &site.survey.frame);
        let review = review::apply(site.review.as_ref(), catalog, frame, &mut blocks, job)?;
        let weights = crate::weights::choose(self.weights(), catalog, &geom::Silent)?.origin;
        let segments = labels.segments(hypotheses);
        // Both halves of a survey are compared where it is recognised whole.
        Ok(Recognition { segments, blocks, pile, weights, review, self_check: None })
    }

    /// The plan must be one of this site.
    fn is_of(&self, site: &Site) -> Result<()> {
        let mut lines: Vec<String> = Vec::new();
        for (name, entry) in &site.inputs {
            if name == io::review::FILE {
                continue;
            }
            if self.inputs().get(name) != Some(entry) {
                lines.push(format!(
                    "{name}: was changed since the plan of tiles was made; make the plan again"
                ));
            }
        }
        let kept = self.points() - self.strays().len() as u64;
        if lines.is_empty() && site.survey.cloud.len() as u64 != kept {
            lines.push(format!(
                "the site's surveys have {} points, the plan of tiles {kept}; make the plan again",
                site.survey.cloud.len()
            ));
        }
        Error::of_lines(lines).map_or(Ok(()), Err)
    }

    /// Every tile with what is done of it. Errors name the tiles.
    fn all_done(&self, job: &Job) -> Result<Vec<(&str, Done)>> {
        let (mut done, mut missing, mut lines) = (Vec::new(), Vec::new(), Vec::new());
        for tile in self.tiles() {
            match self.done(&tile.key) {
                Ok(Some(found)) => done.push((tile.key.as_str(), found)),
                Ok(None) => missing.push(tile.key.as_str()),
                Err(error) => lines.push(error.line()),
            }
        }
        if !missing.is_empty() {
            lines.push(format!(
                "{} of {} tiles are not done: {}{}; work on them with `tsumu tiles run {} --key …`, nothing was merged",
                missing.len(),
                self.tiles().len(),
                missing[..missing.len().min(NAMED)].join(", "),
                if missing.len() > NAMED { ", …" } else { "" },
                self.folder().display()
            ));
        }
        let programs: BTreeSet<&str> = done.iter().map(|d| d.1.program.as_str()).collect();
        if programs.len() > 1 {
            lines.push(self.of_several_programs(&done));
        }
        if let Some(error) = Error::of_lines(lines) {
            return Err(error);
        }
        for (key, found) in &done {
            let other = self.other_results(key, found);
            if !other.is_empty() {
                let message = format!(
                    "tile `{key}` was worked on twice with different results; that of {} counts, {} does not",
                    found.result,
                    other.join(", ")
                );
                job.event(Event::Warned(Warning { stage: Stage::Read, message }));
            }
        }
        Ok(done)
    }

    fn of_several_programs(&self, done: &[(&str, Done)]) -> String {
        let mut by: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (key, found) in done {
            by.entry(found.program.as_str()).or_default().push(key);
        }
        let fewest = by.values().min_by_key(|keys| keys.len()).cloned().unwrap_or_default();
        format!(
            "the tiles were worked on by {} different builds of the program ({}{} by another than the rest); remove their folders in {} and work on them again",
            by.len(),
            fewest[..fewest.len().min(NAMED)].join(", "),
            if fewest.len() > NAMED { ", …" } else { "" },
            self.folder().join(super::work::TILES).display()
        )
    }

    /// Each block once, with its number and its points of the site's survey.
    fn blocks(&self, told: Vec<Told>, site: &Site, labels: &mut Labels) -> Vec<Recognised> {
        let owner = |p: Vec3| {
            let place = self.frame().site_from_local(p).truncate();
            self.tiles().iter().position(|t| self.grid().holds(t.core(), place))
        };
        let mut kept = resolve(told, &site.catalog, owner);
        let d_box_m = site.catalog.iter().map(|(_, m)| f64::from(m.d_box_m)).fold(0.0, f64::max);
        kept.sort_by_cached_key(|claim| {
            let at = self.frame().site_from_local(claim.centre);
            let cell = |v: f64| ((v / d_box_m).floor() as i64 + (1 << 31)) as u64;
            let within = [at.x, at.y, at.z].map(|v| (v * 1e6).round() as i64);
            (interleaved(cell(at.x), cell(at.y)), within)
        });
        let origin = |frame: &scene::SiteFrame| geom::DVec3::from_array(frame.origin);
        let shift = (origin(self.frame()) - origin(&site.survey.frame)).as_vec3();
        let numbered = kept.into_iter().enumerate().map(|(n, claim)| {
            let mut block = claim.block;
            block.block = InstanceId(n as u32 + 1);
            moved(&mut block, shift);
            block.points = labels.own(&block.points);
            block
        });
        numbered.collect()
    }
}

/// One claim for each block: `owner` is the tile whose core holds a place.
fn resolve(
    told: Vec<Told>,
    catalog: &Catalog,
    owner: impl Fn(Vec3) -> Option<usize>,
) -> Vec<Claim> {
    let groups = groups(&told, catalog);
    let mut of_group: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (at, &group) in groups.iter().enumerate() {
        of_group.entry(group).or_default().push(at);
    }
    let mut keep = BTreeSet::new();
    for members in of_group.values() {
        if let [alone] = members[..] {
            if told[alone].claim.own {
                keep.insert(alone);
            }
            continue;
        }
        let sum: Vec3 = members.iter().map(|&m| told[m].claim.centre).sum();
        let of = owner(sum / members.len() as f32);
        let best =
            members.iter().copied().min_by_key(|&m| (Some(told[m].tile) != of, rank(&told[m])));
        keep.extend(best);
    }
    let all = told.into_iter().enumerate();
    all.filter(|(at, _)| keep.contains(at)).map(|(_, told)| told.claim).collect()
}

/// What is stated and surest comes first.
fn rank(told: &Told) -> (bool, u32, usize) {
    let sure = told.claim.block.fit().and_then(|f| f.confidence).unwrap_or(0.0);
    (!told.claim.block.is_stated(), u32::MAX - (sure * 1e6) as u32, told.tile)
}

/// Claims of different tiles that are one block, nearest first; a group has at most one claim of each tile.
fn groups(told: &[Told], catalog: &Catalog) -> Vec<usize> {
    let near_m = |t: &Told| match t.claim.block.fit() {
        Some(fit) => PoseLimits::same_place(catalog.get(fit.model)).displacement_m,
        None => 0.25 * catalog.iter().map(|(_, m)| m.d_box_m).fold(f32::INFINITY, f32::min),
    };
    let widest_m = told.iter().map(near_m).fold(0.0_f32, f32::max).max(f32::MIN_POSITIVE);
    let centres: Vec<Vec3> = told.iter().map(|t| t.claim.centre).collect();
    let grid = geom::PointGrid::new(&centres, 2.0 * widest_m);
    let mut pairs: Vec<(f32, usize, usize)> = Vec::new();
    for (i, one) in told.iter().enumerate() {
        for j in grid.within(centres[i], widest_m) {
            let (j, other) = (j as usize, &told[j as usize]);
            let apart_m = (centres[i] - centres[j]).length();
            if i < j && one.tile != other.tile && apart_m <= near_m(one).min(near_m(other)) {
                pairs.push((apart_m, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut group: Vec<usize> = (0..told.len()).collect();
    let mut members: Vec<Vec<usize>> = (0..told.len()).map(|k| vec![k]).collect();
    for (_, i, j) in pairs {
        let (a, b) = (group[i], group[j]);
        let tiles = |g: usize| members[g].iter().map(|&k| told[k].tile).collect::<BTreeSet<_>>();
        if a != b && tiles(a).is_disjoint(&tiles(b)) {
            let joining = std::mem::take(&mut members[b]);
            joining.iter().for_each(|&k| group[k] = a);
            members[a].extend(joining);
        }
    }
    group
}

/// Bits of the two by turns: what lies near in the world has near numbers.
fn interleaved(x: u64, y: u64) -> u128 {
    let spread =
        |v: u64| (0..64).fold(0_u128, |all, bit| all | u128::from(v >> bit & 1) << (2 * bit));
    spread(x) | spread(y) << 1
}

fn moved(block: &mut Recognised, shift: Vec3) {
    if shift == Vec3::ZERO {
        return;
    }
    match &mut block.verdict {
        Verdict::Stated(fit) | Verdict::NotJudged(Guess::Fit(fit)) => {
            fit.site_from_block.translation += shift;
        }
        Verdict::NotJudged(Guess::Place(place)) => *place += shift,
    }
}

/// Labels of the site's points.
struct Labels<'a> {
    strays: &'a [u32],
    instance: Vec<u32>,
    confidence: Vec<f32>,
    instances: u32,
    taken: Vec<bool>,
}

impl<'a> Labels<'a> {
    fn new(plan: &'a TilePlan, points: usize) -> Self {
        Self {
            strays: plan.strays(),
            instance: vec![0; points],
            confidence: vec![0.0; points],
            instances: 0,
            taken: vec![false; points],
        }
    }

    /// Place among the site's points, which are those of the plan without the strays.
    fn at(&self, number: u32) -> usize {
        number as usize - self.strays.partition_point(|s| *s < number)
    }

    /// An instance; points of two are the surer one's.
    fn add(&mut self, points: &[u32], confidence: &[f32]) {
        self.instances += 1;
        for (&number, &sure) in points.iter().zip(confidence) {
            let at = self.at(number);
            if self.instance[at] == 0 || sure > self.confidence[at] {
                (self.instance[at], self.confidence[at]) = (self.instances, sure);
            }
        }
    }

    /// The site's points of a block, those of an earlier one aside.
    fn own(&mut self, points: &[u32]) -> Vec<u32> {
        let mut own = Vec::with_capacity(points.len());
        for &number in points {
            let at = self.at(number);
            if !std::mem::replace(&mut self.taken[at], true) {
                own.push(at as u32);
            }
        }
        own
    }

    fn segments(self, centre_hypotheses: usize) -> Segments {
        Segments {
            instance: self.instance,
            confidence: self.confidence,
            instances: self.instances as usize,
            centre_hypotheses,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Pose, Quat};
    use scene::{Fit, ModelId, Shape};

    fn catalog() -> Catalog {
        Catalog::new(vec![blocks::shape_model("t", Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap()])
    }

    /// A block at x that `tile` tells of; tile 0 owns x < 0, tile 1 the rest.
    fn told(catalog: &Catalog, tile: usize, x: f32) -> Told {
        let model = catalog.get(ModelId(0));
        let pose = Pose::from_parts(Vec3::new(x, 0.0, 0.0) - model.centre, Quat::IDENTITY);
        let block = Recognised::of_fit(InstanceId(1), vec![], Fit::of_pose(ModelId(0), pose));
        let centre = block.centre(catalog);
        Told { tile, claim: Claim { block, centre, own: (x < 0.0) == (tile == 0) } }
    }

    fn owner(p: Vec3) -> Option<usize> {
        Some(usize::from(p.x >= 0.0))
    }

    #[test]
    fn a_block_on_a_seam_is_kept_once() {
        let catalog = catalog();
        // Both call it theirs, neither does, one sees it a little beyond its core.
        for (by_0, by_1) in [(-0.001, 0.002), (0.001, -0.001), (-0.01, -0.011), (0.2, 0.2)] {
            let both = vec![told(&catalog, 0, by_0), told(&catalog, 1, by_1)];
            let kept = resolve(both, &catalog, owner);
            assert_eq!(kept.len(), 1, "{by_0} {by_1}");
        }
    }

    #[test]
    fn neighbours_stay_two_and_what_its_owner_does_not_see_is_not_there() {
        let catalog = catalog();
        let two = vec![told(&catalog, 0, -0.45), told(&catalog, 1, 0.45), told(&catalog, 1, -0.44)];
        assert_eq!(resolve(two, &catalog, owner).len(), 2);
        let beyond = vec![told(&catalog, 0, 0.2)];
        assert!(resolve(beyond, &catalog, owner).is_empty());
        // Of one tile two places stay two, however near.
        let same = vec![told(&catalog, 0, -0.3), told(&catalog, 0, -0.35)];
        assert_eq!(resolve(same, &catalog, owner).len(), 2);
    }

    #[test]
    fn near_places_have_near_numbers() {
        assert_eq!(interleaved(0b11, 0b01), 0b0111);
        assert!(interleaved(4, 4) > interleaved(3, 3));
    }
}
