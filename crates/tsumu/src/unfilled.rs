//! Places that a plan leaves below the design, in words and as a table.

use crate::summary::UnfilledCount;
use crate::{Result, Site};
use io::unfilled_csv::{self, UnfilledRow};
use plan::{Unfilled, UnfilledReason};
use report::Text;
use std::path::Path;

/// Writes `plan/unfilled.csv`.
pub(crate) fn write(path: &Path, site: &Site, places: &[Unfilled]) -> Result<()> {
    let origin = site.survey.frame.origin;
    let row = |(n, u): (usize, &Unfilled)| UnfilledRow {
        place: n as u32 + 1,
        centre_m: [origin[0] + f64::from(u.centre.x), origin[1] + f64::from(u.centre.y)],
        edge_m: 2.0 * f64::from(u.half_m),
        void_m3: f64::from(u.void_m3),
        trials: u.trials,
        reason: u.reason.word().into(),
        words: why(u.reason).en,
    };
    let rows: Vec<UnfilledRow> = places.iter().enumerate().map(row).collect();
    Ok(unfilled_csv::write(path, &rows)?)
}

/// Places and void of each reason, the largest void first.
pub(crate) fn by_reason(places: &[Unfilled]) -> Vec<UnfilledCount> {
    let of = |reason: UnfilledReason| {
        let own = || places.iter().filter(|u| u.reason == reason);
        UnfilledCount { reason, places: own().count(), void_m3: own().map(|u| u.void_m3).sum() }
    };
    let mut list: Vec<UnfilledCount> =
        UnfilledReason::ALL.into_iter().map(of).filter(|c| c.places > 0).collect();
    list.sort_by(|a, b| b.void_m3.total_cmp(&a.void_m3));
    list
}

/// Why a place got no block, in words.
pub(crate) fn why(reason: UnfilledReason) -> Text {
    let (en, ja) = match reason {
        UnfilledReason::Small => (
            "too small: less than the minimum volume is missing",
            "不足量が最小体積未満（ブロックには小さい）",
        ),
        UnfilledReason::Overflow => {
            ("a block here stands above the design", "ブロックを置くと計画面を超過")
        }
        UnfilledReason::UnstableEdge => (
            "unstable edge: a block here rolls or slides away",
            "不安定な縁（ブロックが転動・滑動する）",
        ),
        UnfilledReason::Unsupported => (
            "unsupported: a block here touches too few others",
            "支持不足（接触するブロックが少ない）",
        ),
        UnfilledReason::Unstable => (
            "a block here is wedged under others or moves under a shake",
            "他のブロックの下に挟まる、または揺すると動く",
        ),
        UnfilledReason::Unsettled => ("a block here does not come to rest", "ブロックが静止しない"),
        UnfilledReason::Boundary => {
            ("no block lies here within the boundary", "施工範囲内に収まる置き方がない")
        }
        UnfilledReason::OutOfReach => ("out of the crane's reach", "クレーンの作業半径外"),
        UnfilledReason::TooLight => {
            ("the zone asks for heavier blocks", "この区域にはより重いブロックが必要")
        }
        UnfilledReason::Stock => ("the blocks in stock are used", "在庫のブロックを使い切った"),
        UnfilledReason::Rounds => (
            "the rounds ended before its turn: raise plan.rounds",
            "計画回数（rounds）の上限に到達",
        ),
        UnfilledReason::Closed => {
            ("covered by a neighbouring place that failed", "隣接箇所の試行失敗により対象外")
        }
    };
    Text::new(en, ja)
}
