//! The small networks and the cloud of the golden numbers in `tests/golden`. To make them anew:
//! `cargo test -p segment --lib -- --ignored golden::make`, then in that folder, with `tools/oracle`,
//! `python fpccv2_forward.py fpccv2.safetensors points.csv fpccv2.csv` and the same for `fpcc`.

use crate::fpcc::{Fpcc, FpccConfig};
use crate::fpccv2::{FpccV2, FpccV2Config};
use crate::network::{NetworkConfig, Weighted};
use crate::{SegmentModel, TrainConfig};
use geom::Vec3;
use net::BackboneConfig;
use net::prelude::Device;
use std::sync::Arc;

pub(crate) fn small_fpcc() -> FpccConfig {
    FpccConfig { batch_points: 90, edge: 8, global: 16, joined: [12, 10], neighbours: 20 }
}

pub(crate) fn small_fpccv2() -> FpccV2Config {
    let backbone = BackboneConfig {
        neighbours: 6,
        dilation: 3,
        edge: vec![6, 7, 8],
        level: vec![8, 9, 10],
        out: 12,
    };
    FpccV2Config { backbone }
}

/// Ninety points on a dented sheet.
pub(crate) fn points() -> Vec<Vec3> {
    rows(include_str!("../tests/golden/points.csv")).iter().map(|r| Vec3::from_slice(r)).collect()
}

pub(crate) fn rows(csv: &str) -> Vec<Vec<f32>> {
    csv.lines().map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect()).collect()
}

/// Writes new random weights; then run the scripts of `tools/oracle` for the numbers.
#[test]
#[ignore = "makes the golden files anew"]
fn make() {
    let device = Device::flex();
    device.seed(11);
    let config =
        TrainConfig { network: NetworkConfig::FpccV2(small_fpccv2()), ..Default::default() };
    let design = small_fpccv2();
    let network = Weighted { weights: FpccV2::new(&design, &device), design };
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    SegmentModel::of_network(Arc::new(network), &config, 0)
        .save(&folder.join("fpccv2.safetensors"))
        .unwrap();
    let bytes =
        net::weights::to_bytes(&Fpcc::new(&small_fpcc(), &device), &Default::default()).unwrap();
    std::fs::write(folder.join("fpcc.safetensors"), bytes).unwrap();
}
