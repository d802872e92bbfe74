//! What was found at each size of block, and one segmentation of it all.

use geom::Vec3;
use scene::{CentreHypothesis, Segmentation};
use std::collections::BTreeMap;

/// What one scale found, metres.
pub(crate) struct AtScale {
    pub hypotheses: Vec<Hypothesis>,
    /// Per point: label (an index into `hypotheses`) and confidence.
    pub label: Vec<Option<(u32, f32)>>,
}

/// A place that may be a block's centre.
pub(crate) struct Hypothesis {
    pub centre: Vec3,
    pub score: f32,
    pub instance: bool,
    /// Points that could be its own, of hypotheses that are no instance.
    pub points: Vec<u32>,
}

/// Everything found at all scales.
#[derive(Default)]
pub(crate) struct Found {
    scales: Vec<AtScale>,
}

impl Found {
    pub fn add(&mut self, scale: AtScale) {
        self.scales.push(scale);
    }

    /// One list: instances with points first, best first. A point takes the surest label of any scale.
    pub fn into_segmentation(self, points: usize) -> Segmentation {
        let mut label: Vec<Option<(usize, u32, f32)>> = vec![None; points];
        for (s, scale) in self.scales.iter().enumerate() {
            for (slot, l) in label.iter_mut().zip(&scale.label) {
                if let Some((h, confidence)) = *l
                    && slot.is_none_or(|best| {
                        let score = |s: usize, h: u32, c: f32| {
                            self.scales[s].hypotheses[h as usize].score * c
                        };
                        score(s, h, confidence) > score(best.0, best.1, best.2)
                    })
                {
                    *slot = Some((s, h, confidence));
                }
            }
        }
        let mut order: Vec<(usize, u32)> = Vec::new();
        let mut count: BTreeMap<(usize, u32), u32> = BTreeMap::new();
        for &(s, h, _) in label.iter().flatten() {
            *count.entry((s, h)).or_default() += 1;
        }
        for (s, scale) in self.scales.iter().enumerate() {
            order.extend((0..scale.hypotheses.len() as u32).map(|h| (s, h)));
        }
        let of = |&(s, h): &(usize, u32)| &self.scales[s].hypotheses[h as usize];
        let is_instance = |key: &(usize, u32)| of(key).instance && count.contains_key(key);
        order.sort_by(|a, b| {
            is_instance(b)
                .cmp(&is_instance(a))
                .then(of(b).score.total_cmp(&of(a).score))
                .then(a.cmp(b))
        });
        let instances = order.iter().filter(|k| is_instance(k)).count();
        let number: BTreeMap<(usize, u32), u32> =
            order.iter().take(instances).enumerate().map(|(i, k)| (*k, i as u32 + 1)).collect();
        let mut hypotheses: Vec<CentreHypothesis> = order
            .iter()
            .map(|k| CentreHypothesis {
                centre: of(k).centre,
                score: of(k).score,
                points: of(k).points.clone(),
            })
            .collect();
        let mut result = Segmentation {
            instance: vec![0; points],
            confidence: vec![0.0; points],
            hypotheses: Vec::new(),
            instances,
        };
        for h in hypotheses.iter_mut().take(instances) {
            h.points.clear();
        }
        for (i, l) in label.iter().enumerate() {
            if let Some((s, h, confidence)) = l
                && let Some(&n) = number.get(&(*s, *h))
            {
                result.instance[i] = n;
                result.confidence[i] = confidence.clamp(0.0, 1.0);
                hypotheses[n as usize - 1].points.push(i as u32);
            }
        }
        result.hypotheses = hypotheses;
        result
    }
}
