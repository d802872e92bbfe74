//! A bin's language for other programs: a request is a line of JSON, so is its answer.

use crate::bin::{Bin, BinLook, Grasp};
use crate::error::OrBadInput;
use crate::{Arrays, Clouds, Error, Job, Result};
use anyhow::{Context, anyhow};
use scene::SensorKind;
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::PathBuf;

/// `{"id": 7, "cloud": "shot.ply"}`, or `"points": [[x, y, z], …]` instead of a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    /// Comes back with the answer.
    #[serde(default)]
    id: Value,
    /// A file with the cloud.
    cloud: Option<PathBuf>,
    /// The cloud itself, metres.
    points: Option<Vec<[f64; 3]>>,
    /// Where the sensor was, metres.
    #[serde(default)]
    sensor_positions: Vec<[f64; 3]>,
    /// How it was measured.
    #[serde(default = "depth_camera")]
    sensor: SensorKind,
}

fn depth_camera() -> SensorKind {
    SensorKind::DepthCamera
}

impl Bin<'_> {
    /// The answer to a line: `{"id", "parts": […], "not_judged"}`, the part to take first at the front; what is wrong with a
    /// request comes back as `{"id", "error", "kind"}` and harms no other.
    pub fn answer(&self, line: &str, job: &Job) -> Value {
        let read = serde_json::from_str::<Request>(line).context("the request").or_bad_input();
        let id = read.as_ref().map_or(Value::Null, |r| r.id.clone());
        match read.and_then(|request| self.looked(request, job)) {
            Ok(look) => self.told(&id, &look),
            Err(e) => json!({ "id": id, "error": e.lines().join("; "), "kind": e.kind() }),
        }
    }

    fn looked(&self, request: Request, job: &Job) -> Result<BinLook> {
        let Request { cloud, points, sensor_positions, sensor, .. } = request;
        match (cloud, points) {
            (Some(file), None) => {
                let clouds =
                    Clouds { files: vec![file], sensor, sensor_positions, ..Clouds::default() };
                self.look_at_files(&clouds, job)
            }
            (None, Some(points)) => {
                self.look(Arrays { points, sensor, sensor_positions, ..Arrays::default() }, job)
            }
            _ => Err(Error::bad_input(anyhow!("the request: give `cloud` (a file) or `points`"))),
        }
    }

    fn told(&self, id: &Value, look: &BinLook) -> Value {
        let parts: Vec<Value> = look.grasps.iter().map(|g| self.part(g, look)).collect();
        let stated = look.blocks.iter().filter(|b| b.is_stated()).count();
        json!({ "id": id, "parts": parts, "not_judged": look.blocks.len() - stated })
    }

    fn part(&self, grasp: &Grasp, look: &BinLook) -> Value {
        let pose = grasp.fit.site_from_block;
        let q = pose.rotation;
        let centre = grasp.fit.centre(self.catalog().get(grasp.model));
        json!({
            "part": grasp.block.0,
            "type": self.catalog().get(grasp.model).name,
            "type_judged": grasp.fit.type_judged,
            "position_m": look.frame.site_from_local(pose.translation).to_array(),
            "quaternion_wxyz": [q.w, q.x, q.y, q.z],
            "centre_m": look.frame.site_from_local(centre).to_array(),
            "confidence": grasp.fit.confidence,
            "occlusion": grasp.fit.occlusion,
            "free": grasp.free,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BinOptions, catalog_of};
    use std::collections::BTreeMap;

    #[test]
    fn a_bad_request_is_answered_and_harms_no_other() {
        let spec = r#"{"block":[{"name":"cube","shape":{"kind":"cube","size":1.0}}]}"#;
        let spec = serde_json::from_str(spec).unwrap();
        let catalog = catalog_of(&spec, &BTreeMap::new(), None, &geom::Silent).unwrap();
        let job = Job::silent();
        let bin = Bin::new(&catalog, &BinOptions::default(), &job).unwrap();
        for (line, said) in [
            ("", "the request"),
            ("[1]", "the request"),
            (r#"{"id": 7}"#, "give `cloud`"),
            (r#"{"id": 7, "cloud": "a.ply", "points": []}"#, "give `cloud`"),
            (r#"{"id": 7, "points": []}"#, "no points"),
            (r#"{"id": 7, "points": [[0, 0]]}"#, "the request"),
            (r#"{"id": 7, "cloud": "nowhere.ply"}"#, "nowhere.ply"),
            (r#"{"id": 7, "speed": 3}"#, "speed"),
        ] {
            let answer = bin.answer(line, &job);
            let error = answer["error"].as_str().unwrap_or_default();
            assert!(error.contains(said), "{line}: {answer}");
            assert_eq!(answer["kind"], "bad-input");
        }
        assert_eq!(bin.answer(r#"{"id": 7}"#, &job)["id"], 7);
    }
}
