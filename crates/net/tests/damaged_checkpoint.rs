//! A training's folder may come from elsewhere or from a broken disk: damage is named, and nothing panics.

use net::Checkpoint;
use net::prelude::{Device, Distribution, GradientsParams, Linear, LinearConfig, Tensor};
use net::training::optimiser;
use std::path::Path;

fn network(device: &Device) -> Linear {
    LinearConfig::new(8, 8).init(device)
}

fn resume(folder: &Path, device: &Device) -> Result<u64, net::CheckpointError> {
    let checkpoint = Checkpoint::open(folder, "{}")?;
    checkpoint.resume(network(device), optimiser(0.0)).map(|(_, _, done)| done)
}

fn saved(folder: &Path, device: &Device) {
    let mut optimiser = optimiser(0.0);
    let network = network(device);
    let input = Tensor::<2>::random([4, 8], Distribution::Default, device);
    let gradients = GradientsParams::from_grads(network.forward(input).sum().backward(), &network);
    let network = optimiser.step(1e-3, network, gradients);
    Checkpoint::open(folder, "{}").unwrap().save(&network, &optimiser, 5, b"model").unwrap();
}

#[test]
fn a_damaged_checkpoint_is_refused_or_harmless() {
    let device = Device::flex().autodiff();
    let folder = tempfile::tempdir().unwrap();
    saved(folder.path(), &device);
    assert_eq!(resume(folder.path(), &device).unwrap(), 5);
    let tree = geom::SeedTree::new(3);
    for name in ["steps", "network.bpk", "optimiser.bpk"] {
        let path = folder.path().join("checkpoint").join(name);
        let whole = std::fs::read(&path).unwrap();
        for cut in [0, 1, whole.len() / 4, whole.len() / 2].into_iter() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            if let Err(error) = resume(folder.path(), &device) {
                assert!(error.path.ends_with(name), "{error}");
            } else {
                assert!(name == "steps" && cut > 0, "{name} cut at {cut} was taken");
            }
        }
        let mut refused = 0;
        for i in 0..200 {
            let mut mutant = whole.clone();
            for step in 0..3 {
                // Headers are where lengths and shapes stand.
                let at = tree.child("at", 3 * i + step).value() as usize % whole.len().min(512);
                mutant[at] = tree.child("byte", 3 * i + step).value() as u8;
            }
            std::fs::write(&path, mutant).unwrap();
            refused += usize::from(resume(folder.path(), &device).is_err());
        }
        assert!(refused > 20, "{name}: {refused} of 200 refused");
        std::fs::write(&path, &whole).unwrap();
    }
    assert_eq!(resume(folder.path(), &device).unwrap(), 5);
}
