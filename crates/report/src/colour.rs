//! Colours that people with colour-blindness and black-and-white printers can tell apart.

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// Block types, in catalogue order (Okabe–Ito without black and yellow).
pub const TYPES: [Rgb; 6] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [213, 94, 0], [86, 180, 233]];

/// Blocks the plan adds.
pub const ADDED: Rgb = [213, 94, 0];

/// Blocks that were not judged.
pub const NOT_JUDGED: Rgb = [150, 150, 150];

/// Colour of a type; they repeat after six.
pub fn of_type(model: u16) -> Rgb {
    TYPES[model as usize % TYPES.len()]
}

/// Dark blue to yellow, even in lightness (cividis); `share` in [0, 1].
pub fn ramp(share: f32) -> Rgb {
    const STOPS: [Rgb; 6] = [
        [0, 32, 81],
        [42, 63, 108],
        [97, 100, 112],
        [140, 137, 120],
        [196, 178, 104],
        [253, 234, 69],
    ];
    between(&STOPS, share)
}

/// Blue below, white on, orange above; `share` in [-1, 1].
pub fn diverging(share: f32) -> Rgb {
    const STOPS: [Rgb; 5] =
        [[33, 79, 138], [140, 175, 214], [247, 247, 247], [242, 174, 114], [166, 73, 10]];
    between(&STOPS, (share + 1.0) / 2.0)
}

fn between(stops: &[Rgb], share: f32) -> Rgb {
    let last = stops.len() - 1;
    let v = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) } * last as f32;
    let i = (v as usize).min(last - 1);
    let f = v - i as f32;
    std::array::from_fn(|k| {
        (f32::from(stops[i][k]) * (1.0 - f) + f32::from(stops[i + 1][k]) * f).round() as u8
    })
}

/// The colour as CSS.
pub fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
