//! How QGIS draws the layers: one renderer a layer, for `layer_styles` in the GeoPackage and again in the project, which
//! does not look there.

/// The style of a layer as QGIS keeps it in `layer_styles`.
pub(crate) fn document(layer: &str) -> String {
    format!(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n<qgis version=\"3.22.16\" styleCategories=\"Symbology|Labeling\" labelsEnabled=\"{}\">{}</qgis>",
        u8::from(label(layer).is_some()),
        body(layer)
    )
}

/// Renderer and labels.
pub(crate) fn body(layer: &str) -> String {
    renderer(layer) + &label(layer).map(labelling).unwrap_or_default()
}

/// Whether its features are labelled.
pub(crate) fn labelled(layer: &str) -> bool {
    label(layer).is_some()
}

fn renderer(layer: &str) -> String {
    match layer {
        "blocks" => by_confidence(),
        "placements" => single(&fill("230,120,20,190", "120,50,0,255", "0.3")),
        "unfilled" => single(&fill("213,94,0,70", "213,94,0,255", "0.4")),
        "not_judged" => single(&marker("150,152,156,255")),
        "design" => single(&line("176,0,32,255", "0.5", "dash")),
        "alignment" => single(&line("20,26,34,255", "0.5", "dash dot")),
        _ => single(&line("90,100,112,255", "0.3", "solid")),
    }
}

/// Field that is written beside a feature, and the size of its letters.
fn label(layer: &str) -> Option<(&'static str, u8)> {
    match layer {
        "placements" => Some(("placing_order", 8)),
        "blocks" => Some(("block_id", 6)),
        "alignment" => Some(("station", 9)),
        _ => None,
    }
}

fn options(pairs: &[(&str, &str)]) -> String {
    let list =
        pairs.iter().map(|(k, v)| format!("<Option type=\"QString\" name=\"{k}\" value=\"{v}\"/>"));
    let old = pairs.iter().map(|(k, v)| format!("<prop k=\"{k}\" v=\"{v}\"/>"));
    format!("<Option type=\"Map\">{}</Option>{}", list.collect::<String>(), old.collect::<String>())
}

fn symbol(kind: &str, name: &str, layer: &str, pairs: &[(&str, &str)]) -> String {
    format!(
        "<symbol type=\"{kind}\" name=\"{name}\" alpha=\"1\" clip_to_extent=\"1\" force_rhr=\"0\"><layer class=\"{layer}\" enabled=\"1\" locked=\"0\" pass=\"0\">{}</layer></symbol>",
        options(pairs)
    )
}

fn fill_named(name: &str, colour: &str, outline: &str, width: &str) -> String {
    let pairs = [
        ("color", colour),
        ("outline_color", outline),
        ("outline_style", "solid"),
        ("outline_width", width),
        ("outline_width_unit", "MM"),
        ("style", "solid"),
    ];
    symbol("fill", name, "SimpleFill", &pairs)
}

fn fill(colour: &str, outline: &str, width: &str) -> String {
    fill_named("0", colour, outline, width)
}

fn line(colour: &str, width: &str, style: &str) -> String {
    let pairs = [
        ("line_color", colour),
        ("line_width", width),
        ("line_width_unit", "MM"),
        ("line_style", style),
    ];
    symbol("line", "0", "SimpleLine", &pairs)
}

fn marker(colour: &str) -> String {
    let pairs = [
        ("name", "cross2"),
        ("color", colour),
        ("outline_color", colour),
        ("outline_width", "0.5"),
        ("size", "3"),
        ("size_unit", "MM"),
    ];
    symbol("marker", "0", "SimpleMarker", &pairs)
}

fn single(symbol: &str) -> String {
    format!(
        "<renderer-v2 type=\"singleSymbol\" symbollevels=\"0\" enableorderby=\"0\" forceraster=\"0\"><symbols>{symbol}</symbols></renderer-v2>"
    )
}

/// Dark blue is doubtful, yellow is sure: the ramp of the report.
fn by_confidence() -> String {
    let classes = [
        (0.0, 0.5, "42,63,108,200"),
        (0.5, 0.75, "97,100,112,200"),
        (0.75, 0.9, "140,137,120,200"),
        (0.9, 0.97, "188,174,108,200"),
        (0.97, 1.0, "222,208,92,200"),
    ];
    let ranges: String = classes
        .iter()
        .enumerate()
        .map(|(i, (low, high, _))| format!("<range symbol=\"{i}\" lower=\"{low:.6}\" upper=\"{high:.6}\" label=\"{low} – {high}\" render=\"true\"/>"))
        .collect();
    let symbols: String = classes
        .iter()
        .enumerate()
        .map(|(i, (_, _, colour))| fill_named(&i.to_string(), colour, "50,60,72,255", "0.2"))
        .collect();
    format!(
        "<renderer-v2 type=\"graduatedSymbol\" attr=\"confidence\" graduatedMethod=\"GraduatedColor\" symbollevels=\"0\" enableorderby=\"0\" forceraster=\"0\"><ranges>{ranges}</ranges><symbols>{symbols}</symbols></renderer-v2>"
    )
}

fn labelling((field, size): (&'static str, u8)) -> String {
    format!(
        "<labeling type=\"simple\"><settings calloutType=\"simple\"><text-style fieldName=\"{field}\" isExpression=\"0\" fontSize=\"{size}\" fontSizeUnit=\"Point\" fontFamily=\"Sans\" fontWeight=\"75\" textColor=\"20,26,34,255\" namedStyle=\"Bold\"><text-buffer bufferDraw=\"1\" bufferSize=\"0.8\" bufferSizeUnits=\"MM\" bufferColor=\"255,255,255,220\"/></text-style><placement placement=\"1\" quadOffset=\"4\" centroidWhole=\"1\" centroidInside=\"0\"/><rendering drawLabels=\"1\" obstacle=\"0\" displayAll=\"0\"/></settings></labeling>"
    )
}

/// How a raster is drawn: differences diverge about zero, heights run from dark to light. `low` and `high` are the values
/// between which the colours run.
pub(crate) fn raster(diverging: bool, low: f64, high: f64) -> String {
    const DIVERGING: [[u8; 3]; 5] =
        [[33, 79, 138], [140, 175, 214], [247, 247, 247], [240, 160, 120], [170, 50, 30]];
    const HEIGHTS: [[u8; 3]; 5] =
        [[0, 32, 81], [70, 82, 110], [124, 123, 118], [176, 164, 110], [222, 208, 92]];
    let stops = if diverging { DIVERGING } else { HEIGHTS };
    let items: String = (0..5)
        .map(|i| {
            let value = low + (high - low) * f64::from(i) / 4.0;
            let [r, g, b] = stops[i as usize];
            format!("<item value=\"{value}\" label=\"{value:.2}\" color=\"#{r:02x}{g:02x}{b:02x}\" alpha=\"255\"/>")
        })
        .collect();
    format!(
        "<pipe><rasterrenderer type=\"singlebandpseudocolor\" band=\"1\" opacity=\"1\" alphaBand=\"-1\" classificationMin=\"{low}\" classificationMax=\"{high}\"><rasterTransparency/><rastershader><colorrampshader colorRampType=\"INTERPOLATED\" classificationMode=\"1\" clip=\"0\" minimumValue=\"{low}\" maximumValue=\"{high}\">{items}</colorrampshader></rastershader></rasterrenderer><brightnesscontrast brightness=\"0\" contrast=\"0\"/><huesaturation saturation=\"0\"/><rasterresampler maxOversampling=\"2\"/></pipe>"
    )
}

/// The style of a raster as QGIS finds it beside the image, `NAME.qml`.
pub(crate) fn raster_document(diverging: bool, low: f64, high: f64) -> String {
    format!(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n<qgis version=\"3.22.16\" styleCategories=\"Symbology\">{}</qgis>\n",
        raster(diverging, low, high)
    )
}
