//! What a file could be in a site, by the ending of its name.

use serde::Serialize;
use std::path::Path;

/// Parts of a site that a file could be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct InputKinds {
    /// A cloud.
    pub survey: bool,
    /// A design surface.
    pub design: bool,
    /// An alignment.
    pub alignment: bool,
    /// A block's mesh.
    pub mesh: bool,
}

impl InputKinds {
    /// By the file's name alone.
    pub fn of(file: &Path) -> Self {
        let ending = file.extension().map(|e| e.to_string_lossy().to_lowercase());
        let ending = ending.unwrap_or_default();
        let one_of = |list: &[&str]| list.contains(&ending.as_str());
        let mut clouds = io::points::READABLE.split(", ").map(|e| e.trim_start_matches('.'));
        Self {
            survey: clouds.any(|e| e == ending),
            design: one_of(&["xml", "landxml", "tif", "tiff", "dxf"]),
            alignment: one_of(&["xml", "landxml", "dxf", "csv", "txt", "xyz"]),
            mesh: one_of(&["stl", "obj", "ply"]),
        }
    }

    /// Whether a site could use it at all.
    pub fn any(self) -> bool {
        self.survey || self.design || self.alignment || self.mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_what_a_file_could_be() {
        let of = |name: &str| InputKinds::of(Path::new(name));
        assert!(of("a.LAZ").survey && of("b.copc.laz").survey && !of("a.laz").design);
        assert!(of("d.dxf").design && of("d.dxf").alignment && !of("d.dxf").survey);
        assert!(of("block.stl").mesh && !of("run.exe").any() && !of("laz").any());
    }
}
