//! The learning curve as a small SVG, from the columns of `curve.csv`.

/// Width and height of the picture.
const SIZE: (f32, f32) = (720.0, 360.0);
/// Space for axes.
const MARGIN: f32 = 48.0;

/// Vote error over steps: training (grey) and held out (blue), logarithmic.
pub(super) fn learning_curve(csv: &str) -> String {
    let column =
        |line: &str, at: usize| line.split(',').nth(at).and_then(|v| v.parse::<f32>().ok());
    let points = |at: usize| -> Vec<(f32, f32)> {
        csv.lines()
            .skip(1)
            .filter_map(|l| Some((column(l, 0)?, column(l, at)?)))
            .filter(|p| p.1 > 0.0)
            .collect()
    };
    let (train, held_out) = (points(5), points(10));
    let last = train.iter().chain(&held_out).map(|p| p.0).fold(1.0, f32::max);
    let (low, high) = (0.02_f32, 1.0_f32);
    let place = |(step, error): (f32, f32)| {
        let x = MARGIN + step / last * (SIZE.0 - 1.5 * MARGIN);
        let part = (error.clamp(low, high) / low).ln() / (high / low).ln();
        (x, SIZE.1 - MARGIN - part * (SIZE.1 - 1.5 * MARGIN))
    };
    let line = |points: &[(f32, f32)], colour: &str| {
        let path: Vec<String> =
            points.iter().map(|&p| place(p)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        format!(
            "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\" points=\"{}\"/>\n",
            path.join(" ")
        )
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        SIZE.0, SIZE.1
    );
    for error in [0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
        let (x, y) = place((0.0, error));
        svg += &format!(
            "<path d=\"M{x} {y:.1}H{}\" stroke=\"#ddd\"/><text x=\"8\" y=\"{:.1}\">{error}</text>\n",
            SIZE.0 - MARGIN / 2.0,
            y + 4.0
        );
    }
    svg += &line(&train, "#999");
    svg += &line(&held_out, "#06c");
    svg += &format!(
        "<text x=\"{MARGIN}\" y=\"16\">mean error of a vote, d_max: training (grey), held out (blue)</text>\n\
         <text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{last} steps</text>\n</svg>\n",
        SIZE.0 - MARGIN / 2.0,
        SIZE.1 - MARGIN / 2.0
    );
    svg
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_line_for_each_curve() {
        let csv = "step,…\n20,1e-3,1,1,1,0.5,1,,,,,\n40,1e-3,1,1,1,0.25,1,1,1,1,0.3,1\n";
        let svg = super::learning_curve(csv);
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert!(svg.contains("40 steps") && svg.ends_with("</svg>\n"));
    }
}
