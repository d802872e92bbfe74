//! Files that do not mean what they seem to: each kind of mistake that was reported of programs of this sort, made small, with
//! its brothers. What is right is said in the test.

mod designs;
mod las_file;
mod marks_and_records;
mod meshes;
mod reference_systems;
mod strays_and_steps;
mod text_clouds;

use geom::{DVec3, Event, Observer};
use io::{Input, RawCloud, points};
use std::path::Path;
use std::sync::Mutex;

/// Collects what a reader says.
#[derive(Default)]
pub struct Heard(Mutex<Vec<String>>);

impl Observer for Heard {
    fn event(&self, event: Event) {
        let text = match event {
            Event::Warned(w) => format!("warning: {}", w.message),
            Event::Noted { message, .. } => message,
            _ => return,
        };
        self.0.lock().unwrap().push(text);
    }
}

impl Heard {
    /// Everything, a line each.
    pub fn all(&self) -> String {
        self.0.lock().unwrap().join("\n")
    }
}

/// Reads bytes as a file of this kind; what the reader said comes with the cloud.
pub fn read(kind: &str, bytes: &[u8]) -> Result<(RawCloud, String), String> {
    let (name, heard) = (format!("a.{kind}"), Heard::default());
    let mut input = Input::of_bytes(Path::new(&name), bytes);
    let cloud = points::read_as(&mut input, kind, &heard).map_err(|e| e.to_string())?;
    Ok((cloud, heard.all()))
}

/// A heap of points on the coast of Ibaraki, zone IX.
pub fn heap(n: usize) -> Vec<DVec3> {
    let at = |i: usize| {
        let t = i as f64;
        let (x, y) = ((t * 0.371).sin() * 4.0, (t * 0.613).cos() * 4.0);
        let z = 3.4 - 0.2 * x.abs() - 0.1 * y.abs() + (t * 1.7).sin() * 0.05;
        DVec3::new(41_250.0 + x, -98_760.0 + y, (z * 1000.0).round() / 1000.0)
    };
    (0..n).map(at).collect()
}
