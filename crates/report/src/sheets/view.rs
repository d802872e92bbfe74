//! A window of the site on a sheet: a scale, a turn, and where things fall.

use super::frame::{INK, THIN};
use super::paper::{Align, Paper, Pen};
use geom::Vec2;

/// Scales that rulers have.
pub(crate) const SCALES: [f32; 11] =
    [10.0, 20.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 500.0, 1000.0, 2500.0];

/// The largest picture that shows so many metres in so many millimetres: 1 to this.
pub(crate) fn scale_for(size_m: [f32; 2], room_mm: [f32; 2]) -> f32 {
    let needed = (size_m[0] * 1000.0 / room_mm[0]).max(size_m[1] * 1000.0 / room_mm[1]);
    SCALES.into_iter().find(|s| *s >= needed).unwrap_or_else(|| {
        let power = 10_f32.powf(needed.log10().floor());
        (needed / power).ceil() * power
    })
}

/// A plan window: `along` lies to the right on the sheet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Local place in the middle.
    pub middle: Vec2,
    /// Unit vector that points right.
    pub along: Vec2,
    /// 1 to this.
    pub scale: f32,
    /// Middle of the window on the sheet, millimetres.
    pub at: [f32; 2],
}

impl View {
    /// Where a local place falls on the sheet.
    pub fn on(&self, p: Vec2) -> [f32; 2] {
        let d = (p - self.middle) * (1000.0 / self.scale);
        [self.at[0] + d.dot(self.along), self.at[1] + self.along.perp_dot(d)]
    }

    /// An arrow to the north, and its letter.
    pub fn north(&self, paper: &mut Paper, at: [f32; 2]) {
        let up = [self.along.y, self.along.x];
        let side = [up[1], -up[0]];
        let p = |u: f32, s: f32| [at[0] + up[0] * u + side[0] * s, at[1] + up[1] * u + side[1] * s];
        let half = |s: f32| vec![p(10.0, 0.0), p(-7.0, s), p(-4.0, 0.0)];
        paper.rings(&[half(3.4)], Some([255, 255, 255]), Some(THIN));
        paper.rings(&[half(-3.4)], Some(INK), Some(THIN));
        let n = p(13.0, 0.0);
        paper.words([n[0], n[1] - 1.6], 4.5, Align::Middle, "N", INK);
    }
}

/// A scale bar with its length; from its lower left corner.
pub(crate) fn scale_bar(paper: &mut Paper, at: [f32; 2], scale: f32) {
    let metres = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0_f32]
        .into_iter()
        .find(|m| m * 1000.0 / scale >= 30.0)
        .unwrap_or(500.0);
    let long = metres * 1000.0 / scale;
    let pen = Pen::solid(0.2, INK);
    for k in 0..4 {
        let fill = if k % 2 == 0 { INK } else { [255, 255, 255] };
        paper.rect(
            [at[0] + long * k as f32 / 4.0, at[1]],
            [long / 4.0, 1.6],
            Some(fill),
            Some(pen),
        );
    }
    paper.words([at[0], at[1] + 2.6], 2.6, Align::Middle, "0", INK);
    paper.words([at[0] + long, at[1] + 2.6], 2.6, Align::Middle, &format!("{metres} m"), INK);
}
