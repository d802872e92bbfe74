//! The frame of a drawing: data to pixels, axes with round numbers.

use crate::Text;
use std::fmt::Write;

/// A rectangle of pixels that shows a rectangle of data, y upwards.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    pub width: f64,
    pub height: f64,
    pub left: f64,
    pub bottom: f64,
    pub right: f64,
    pub top: f64,
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl Chart {
    /// A chart whose y axis fills the height.
    pub fn new(width: f64, height: f64, x: [f64; 2], y: [f64; 2]) -> Self {
        Self {
            width,
            height,
            left: 62.0,
            bottom: 46.0,
            right: 16.0,
            top: 14.0,
            x: widened(x),
            y: widened(y),
        }
    }

    pub fn px(&self, x: f64) -> f64 {
        self.left
            + (x - self.x[0]) / (self.x[1] - self.x[0]) * (self.width - self.left - self.right)
    }

    pub fn py(&self, y: f64) -> f64 {
        self.height
            - self.bottom
            - (y - self.y[0]) / (self.y[1] - self.y[0]) * (self.height - self.top - self.bottom)
    }

    /// Opens the SVG element with its accessible name.
    pub fn open(&self, class: &str, name: &str) -> String {
        format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {:.0} {:.0}\" role=\"img\" aria-label=\"{}\">",
            self.width,
            self.height,
            crate::text::escape(name)
        )
    }

    /// Grid lines, numbers and axis names.
    pub fn axes(&self, x_name: &Text, y_name: &Text) -> String {
        let mut svg = String::from("<g class=\"axes\">");
        let (x0, x1, y0, y1) =
            (self.left, self.width - self.right, self.top, self.height - self.bottom);
        for (value, label) in ticks(self.x, (self.width / 90.0) as usize) {
            let x = self.px(value);
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} {y0:.1}V{y1:.1}\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                y1 + 16.0
            );
        }
        for (value, label) in ticks(self.y, ((self.height / 45.0) as usize).max(2)) {
            let y = self.py(value);
            let _ = write!(
                svg,
                "<path d=\"M{x0:.1} {y:.1}H{x1:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                x0 - 6.0,
                y + 4.0
            );
        }
        let _ = write!(
            svg,
            "<rect x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            x1 - x0,
            y1 - y0
        );
        svg += &x_name.svg(&format!(
            "x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\"",
            (x0 + x1) / 2.0,
            self.height - 8.0
        ));
        let turned = format!(
            "transform=\"translate(13 {:.1}) rotate(-90)\" text-anchor=\"middle\"",
            (y0 + y1) / 2.0
        );
        svg + &y_name.svg(&turned) + "</g>"
    }
}

/// A range with some width.
fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    match (low.is_finite() && high.is_finite(), high - low) {
        (false, _) => [0.0, 1.0],
        (_, d) if d < 1e-9 => [low - 0.5, high + 0.5],
        _ => [low, high],
    }
}

/// About `wanted` round values inside the range, with their text.
pub(crate) fn ticks([low, high]: [f64; 2], wanted: usize) -> Vec<(f64, String)> {
    let rough = (high - low) / wanted.max(1) as f64;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= rough * 0.999)
        .unwrap_or(power);
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step - 1e-6).ceil() as i64;
    let last = (high / step + 1e-6).floor() as i64;
    (first..=last)
        .map(|i| (i as f64 * step, format!("{:.digits$}", i as f64 * step).replace("-0.0", "0.0")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let labels = |range, n| ticks(range, n).into_iter().map(|(_, l)| l).collect::<Vec<_>>();
        assert_eq!(labels([0.0, 1.0], 5), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels([-62341.2, -62326.9], 3), ["-62340", "-62335", "-62330"]);
    }
}
