//! The surface that model space shows: blocks only where they are inserted, layers only when they are on, no paper.

use super::arbitrary_axes;
use super::entities::{self, Entities, Entity, plain};
use super::meshes;
use crate::crs::Unit;
use crate::input::Input;
use crate::{IoError, Place};
use geom::{DMat3, DVec3};
use std::collections::BTreeMap;

/// Blocks inside blocks.
const DEPTH: usize = 16;
/// Triangles that any drawing may unfold to, and how many more for each of its bytes.
const FREE_FACES: usize = 100_000;
const BYTES_PER_FACE: u64 = 8;

/// A surface and what a reader should know of it.
#[derive(Clone, Debug, Default)]
pub struct DxfSurface {
    /// Triangles in the file's coordinates and unit.
    pub faces: Vec<[DVec3; 3]>,
    /// `$INSUNITS`, when it says something.
    pub unit: Option<Unit>,
    /// Layers with the number of their triangles.
    pub layers: BTreeMap<String, usize>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// Triangles of the drawing's surface, in the file's coordinates.
pub fn read_faces(input: &mut Input) -> Result<Vec<[DVec3; 3]>, IoError> {
    read_surface(input, None).map(|s| s.faces)
}

/// Reads the surface; with `layer` that layer alone, even one that is off.
pub fn read_surface(input: &mut Input, layer: Option<&str>) -> Result<DxfSurface, IoError> {
    let entities = entities::read(input)?;
    let most = FREE_FACES + (input.len / BYTES_PER_FACE) as usize;
    let mut walk = Walk {
        entities: &entities,
        wanted: layer.map(plain),
        most,
        work: 0,
        out: DxfSurface { unit: entities.unit.clone(), ..DxfSurface::default() },
        hidden: BTreeMap::new(),
        missing: BTreeMap::new(),
        smoothed: 0,
    };
    let still = Placed { linear: DMat3::IDENTITY, shift: DVec3::ZERO };
    if walk.entities(&entities.model, &still, None, 0).is_none() {
        let what = format!(
            "the drawing's blocks unfold to more than {most} triangles; export the surface alone, as 3D faces"
        );
        return Err(input.malformed(Place::File, what));
    }
    walk.finish(input)
}

/// Takes a block's coordinates to the drawing's.
struct Placed {
    linear: DMat3,
    shift: DVec3,
}

impl Placed {
    fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.shift
    }
}

struct Walk<'a> {
    entities: &'a Entities,
    wanted: Option<String>,
    most: usize,
    /// Entities and triangles met so far.
    work: usize,
    out: DxfSurface,
    /// Triangles on layers that do not show.
    hidden: BTreeMap<String, usize>,
    /// Blocks that are in another file, or nowhere.
    missing: BTreeMap<String, usize>,
    smoothed: usize,
}

impl Walk<'_> {
    /// `None` when it would be too much. `outer` is the layer of the INSERT that brought the entities here.
    fn entities(
        &mut self,
        list: &[Entity],
        placed: &Placed,
        outer: Option<&str>,
        depth: usize,
    ) -> Option<()> {
        for entity in list {
            self.work += 1;
            if self.work > self.most {
                return None;
            }
            if entity.paper || entity.invisible {
                continue;
            }
            // What a block draws on layer 0 appears on the layer of its INSERT.
            let layer = match outer {
                Some(outer) if entity.layer == "0" || entity.layer.is_empty() => outer,
                _ => entity.layer.as_str(),
            };
            if entity.kind == "INSERT" {
                self.insert(entity, placed, layer, depth)?;
            } else if let Some(faces) = meshes::faces(entity) {
                self.surface(entity, &faces, placed, layer)?;
            } else if outer.is_none() {
                *self.other(&entity.kind) += 1;
            }
        }
        Some(())
    }

    fn other(&mut self, kind: &str) -> &mut usize {
        self.hidden.entry(format!("\u{1}{kind}")).or_default()
    }

    fn surface(
        &mut self,
        entity: &Entity,
        faces: &[[DVec3; 3]],
        placed: &Placed,
        layer: &str,
    ) -> Option<()> {
        self.work += faces.len();
        if self.work > self.most {
            return None;
        }
        if !self.shows(layer) {
            *self.hidden.entry(layer.to_string()).or_default() += faces.len();
            return Some(());
        }
        self.smoothed += usize::from(meshes::is_smoothed(entity));
        *self.out.layers.entry(layer.to_string()).or_default() += faces.len();
        self.out.faces.extend(faces.iter().map(|f| f.map(|p| placed.point(p))));
        Some(())
    }

    fn shows(&self, layer: &str) -> bool {
        match &self.wanted {
            Some(wanted) => *wanted == layer,
            None => {
                let state = self.entities.layers.get(layer).copied().unwrap_or_default();
                !state.off && !state.frozen
            }
        }
    }

    fn insert(
        &mut self,
        insert: &Entity,
        placed: &Placed,
        layer: &str,
        depth: usize,
    ) -> Option<()> {
        let name = plain(insert.text(2).unwrap_or_default());
        let entities = self.entities;
        let frozen = entities.layers.get(layer).is_some_and(|l| l.frozen);
        if frozen && self.wanted.is_none() {
            *self.hidden.entry(layer.to_string()).or_default() += 1;
            return Some(());
        }
        let Some(block) = entities.blocks.get(&name).filter(|b| !b.external) else {
            *self.missing.entry(name).or_default() += 1;
            return Some(());
        };
        if depth >= DEPTH {
            return None;
        }
        let count = |code: i32| insert.integer(code).unwrap_or(1).clamp(1, 100_000);
        for row in 0..count(71) {
            for column in 0..count(70) {
                self.work += 1;
                if self.work > self.most {
                    return None;
                }
                let here = of_insert(insert, block.base, [column, row], placed);
                self.entities(&block.entities, &here, Some(layer), depth + 1)?;
            }
        }
        Some(())
    }

    fn finish(mut self, input: &Input) -> Result<DxfSurface, IoError> {
        let mut lines = self.entities.others.clone();
        let hidden = std::mem::take(&mut self.hidden);
        let (kinds, layers): (Vec<_>, Vec<_>) =
            hidden.into_iter().partition(|(name, _)| name.starts_with('\u{1}'));
        for (kind, n) in kinds {
            *lines.entry(kind[1..].to_string()).or_default() += n;
        }
        let listed = |all: &[(String, usize)]| {
            all.iter()
                .take(12)
                .map(|(name, n)| format!("`{name}` ({n})"))
                .collect::<Vec<_>>()
                .join(", ")
        };
        if !layers.is_empty() {
            let why = if self.wanted.is_some() {
                "other layers"
            } else {
                "layers that are off or frozen"
            };
            self.out.notes.push(format!("faces on {why} were left out: {}", listed(&layers)));
        }
        let missing: Vec<_> = self.missing.into_iter().collect();
        if !missing.is_empty() {
            let found = format!("blocks of other files were left out: {}", listed(&missing));
            self.out.notes.push(found);
        }
        let lines: Vec<_> = lines.into_iter().collect();
        if !lines.is_empty() {
            self.out
                .notes
                .push(format!("entities that are no faces were left out: {}", listed(&lines)));
        }
        if self.smoothed > 0 {
            let n = self.smoothed;
            self.out.notes.push(format!(
                "{n} MESH entities are shown smoothed; their corners were taken as they are"
            ));
        }
        if !self.out.faces.is_empty() {
            return Ok(self.out);
        }
        let what = if let Some(layer) = &self.wanted {
            let known: Vec<&str> = layers.iter().map(|l| l.0.as_str()).collect();
            format!(
                "there is no face on the layer `{layer}`; there are faces on {}",
                if known.is_empty() { "no layer".into() } else { known.join(", ") }
            )
        } else if layers.is_empty() {
            let others = if lines.is_empty() {
                String::new()
            } else {
                format!(" (it has {})", listed(&lines))
            };
            format!(
                "model space has no complete 3DFACE, polyface or MESH{others}; export the surface as 3D faces"
            )
        } else {
            format!(
                "every face is on a layer that is off or frozen: {}; turn it on, or name it: `surface = \"{}\"`",
                listed(&layers),
                layers[0].0
            )
        };
        Err(input.malformed(Place::File, what))
    }
}

/// Insertion point, scales, turn and extrusion of an INSERT, in an array at this column and row.
fn of_insert(insert: &Entity, base: DVec3, at: [i64; 2], outer: &Placed) -> Placed {
    let number = |code: i32, default: f64| insert.number(code).unwrap_or(default);
    let normal = insert.normal();
    let [ax, ay] = arbitrary_axes(normal);
    let axes = DMat3::from_cols(ax, ay, normal);
    let turn = DMat3::from_rotation_z(number(50, 0.0).to_radians());
    let scale = DMat3::from_diagonal(DVec3::new(number(41, 1.0), number(42, 1.0), number(43, 1.0)));
    let step = DVec3::new(at[0] as f64 * number(44, 0.0), at[1] as f64 * number(45, 0.0), 0.0);
    let origin = insert.point(10).unwrap_or_default() + turn * step;
    let linear = axes * turn * scale;
    let shift = axes * origin - linear * base;
    Placed { linear: outer.linear * linear, shift: outer.point(shift) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(text: &str, layer: Option<&str>) -> Result<DxfSurface, String> {
        let mut input = Input::of_bytes(Path::new("a.dxf"), text.as_bytes());
        read_surface(&mut input, layer).map_err(|e| e.to_string())
    }

    /// Pairs of a code and a value, one after another.
    fn dxf(pairs: &str) -> String {
        pairs.split_whitespace().map(|w| format!("{w}\n")).collect()
    }

    fn triangle(layer: &str, z: f64) -> String {
        format!(
            "0 3DFACE 8 {layer} 10 0 20 0 30 {z} 11 1 21 0 31 {z} 12 0 22 1 32 {z} 13 0 23 1 33 {z} "
        )
    }

    fn drawing(tables: &str, blocks: &str, model: &str) -> String {
        dxf(&format!(
            "0 SECTION 2 TABLES 0 TABLE 2 LAYER {tables} 0 ENDTAB 0 ENDSEC 0 SECTION 2 BLOCKS {blocks} 0 ENDSEC 0 SECTION 2 ENTITIES {model} 0 ENDSEC 0 EOF"
        ))
    }

    #[test]
    fn only_what_model_space_shows_counts() {
        let tables = "0 LAYER 2 OLD 70 0 62 -3 0 LAYER 2 COLD 70 1 62 3 0 LAYER 2 FG 70 0 62 3";
        let unused = format!("0 BLOCK 2 UNUSED 10 0 20 0 30 0 {} 0 ENDBLK", triangle("0", 5.5));
        let model = [
            triangle("FG", 3.4),
            triangle("old", 5.0),
            triangle("COLD", 6.0),
            triangle("FG", 9.0).replace("8 FG", "8 FG 67 1"),
            "0 LINE 8 FG 10 0 20 0 30 0 11 1 21 1 31 0 0 3DSOLID 8 FG ".into(),
        ];
        let file = drawing(tables, &unused, &model.concat());
        let found = read(&file, None).unwrap();
        assert_eq!(found.faces.len(), 1);
        assert_eq!(found.faces[0][0].z, 3.4);
        let notes = found.notes.join("\n");
        for part in ["`OLD` (1)", "`COLD` (1)", "`3DSOLID` (1)", "`LINE` (1)"] {
            assert!(notes.contains(part), "{part}: {notes}");
        }
        assert_eq!(read(&file, Some("old")).unwrap().faces[0][0].z, 5.0);
        assert!(read(&file, Some("nowhere")).unwrap_err().contains("FG"));
        let off = read(&drawing(tables, "", &triangle("OLD", 5.0)), None).unwrap_err();
        assert!(off.contains("off or frozen") && off.contains("OLD"), "{off}");
    }

    #[test]
    fn inserts_are_placed_turned_scaled_and_repeated() {
        let block = format!("0 BLOCK 2 B 10 1 20 0 30 0 {} 0 ENDBLK", triangle("0", 2.0));
        let insert = "0 INSERT 8 FG 2 b 10 100 20 50 30 1 41 2 42 2 43 1 50 90 70 2 44 10";
        let found = read(&drawing("", &block, insert), None).unwrap();
        assert_eq!(found.faces.len(), 2);
        assert_eq!(found.layers.get("FG"), Some(&2));
        // (0,0,2) less the base is (−1,0,2); twice as large and turned: (0,−2,2).
        let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-9, "{a} {b}");
        near(found.faces[0][0], DVec3::new(100.0, 48.0, 3.0));
        near(found.faces[1][0], DVec3::new(100.0, 58.0, 3.0));
    }

    #[test]
    fn blocks_in_blocks_end_somewhere() {
        let circle = "0 BLOCK 2 B 10 0 20 0 30 0 0 INSERT 8 0 2 B 10 0 20 0 30 0 0 INSERT 8 0 2 B 10 0 20 0 30 0 0 ENDBLK";
        let error =
            read(&drawing("", circle, "0 INSERT 8 0 2 B 10 0 20 0 30 0"), None).unwrap_err();
        assert!(error.contains("unfold"), "{error}");
    }

    #[test]
    fn polyfaces_meshes_and_polygon_meshes_are_surfaces() {
        let vertex =
            |x: f64, y: f64, flags: u32| format!("0 VERTEX 8 0 10 {x} 20 {y} 30 4 70 {flags} ");
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let corners = |flags: u32| square.map(|(x, y)| vertex(x, y, flags)).concat();
        let polyface = format!(
            "0 POLYLINE 8 FG 66 1 70 64 71 4 72 1 {} 0 VERTEX 8 0 10 0 20 0 30 0 70 128 71 1 72 2 73 3 74 -4 0 SEQEND",
            corners(192)
        );
        let grid = format!("0 POLYLINE 8 FG 66 1 70 16 71 2 72 2 {} 0 SEQEND", corners(64));
        let mesh = "0 MESH 8 FG 91 0 92 4 10 0 20 0 30 4 10 1 20 0 30 4 10 1 20 1 30 4 10 0 20 1 30 4 93 5 90 4 90 0 90 1 90 2 90 3 94 0 95 0";
        for model in [polyface.as_str(), grid.as_str(), mesh] {
            let found = read(&drawing("", "", model), None).unwrap();
            assert_eq!(found.faces.len(), 2, "{model}");
            assert!(found.faces.iter().flatten().all(|p| p.z == 4.0));
        }
    }

    #[test]
    fn the_unit_is_read() {
        let file = format!(
            "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n{}",
            drawing("", "", &triangle("0", 3.0))
        );
        assert_eq!(read(&file, None).unwrap().unit.unwrap().name, "millimetre");
    }
}
