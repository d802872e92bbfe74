//! Time of the fused graph convolution, forward and backward, on one thread.

use geom::{SeedTree, Vec3};
use net::Neighbourhood;
use net::attentive_pooling::{PoolingWeights, RELATIVE, pool, pool_backward};
use rand::RngExt;
use std::time::Instant;

fn main() {
    let n = 2048;
    let mut rng = SeedTree::new(1).rng();
    let points: Vec<Vec3> = (0..n)
        .map(|_| {
            Vec3::new(rng.random::<f32>() * 6.0, rng.random::<f32>() * 6.0, rng.random::<f32>())
        })
        .collect();
    let clock = Instant::now();
    let hood = Neighbourhood::dilated(points, 20, 4);
    println!("neighbourhood of {n}: {:.1} ms", clock.elapsed().as_secs_f64() * 1e3);
    for c in [54, 86, 118] {
        let mut draw =
            |count: usize| -> Vec<f32> { (0..count).map(|_| rng.random::<f32>() - 0.5).collect() };
        let (a, position, bias) = (draw(n * c), draw(RELATIVE * c), draw(c));
        let attention = draw((c + RELATIVE) * (c + RELATIVE));
        let weights = PoolingWeights { position: &position, bias: &bias, attention: &attention };
        let clock = Instant::now();
        let out = pool(&a, &hood, n, weights);
        let forward = clock.elapsed().as_secs_f64() * 1e3;
        let clock = Instant::now();
        let grads = pool_backward(&a, &hood, weights, &out);
        let backward = clock.elapsed().as_secs_f64() * 1e3;
        println!(
            "{c} features: forward {forward:.1} ms, backward {backward:.1} ms ({})",
            grads.bias[0]
        );
    }
}
