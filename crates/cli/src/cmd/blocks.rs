//! `tsumu blocks`: what can be named in a catalogue.

use clap::Args;
use serde_json::json;
use terminal::Terminal;
use tsumu::Result;

/// List the built-in blocks: kind and nominal tonnage, with height and volume.
///
/// Each name is a `shape` of catalog.toml; any other tonnage ("dolos 7t") or size ("cube 1.5m") is taken too. Shapes whose kind
/// ends in -like follow the overall proportions of their namesakes' public drawings.
#[derive(Debug, Args)]
pub struct BlocksArgs {}

/// Prints the list.
pub fn blocks(_: &BlocksArgs, terminal: &Terminal) -> Result<()> {
    let all = scene::nominal_blocks();
    let rows: Vec<_> = all
        .iter()
        .map(|b| {
            json!({ "name": b.name(), "kind": b.kind, "nominal_t": b.tonnes,
                    "height_m": b.size_m, "volume_m3": b.volume_m3 })
        })
        .collect();
    terminal.emit("blocks", &rows);
    terminal.say(format!("{:<24}{:>10}{:>12}", "name", "height m", "volume m³"));
    for b in &all {
        terminal.say(format!("{:<24}{:>10.3}{:>12.2}", b.name(), b.size_m, b.volume_m3));
    }
    Ok(())
}
