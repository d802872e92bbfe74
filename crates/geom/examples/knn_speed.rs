//! Batch k-nearest neighbours against kiddo, k = 80, one thread: `knn_speed [POINTS]`.

use geom::{SeedTree, Vec3, knn};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rand::RngExt;
use std::num::NonZero;
use std::time::Instant;

fn main() {
    let n: usize = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(100_000);
    let k = 80;
    let mut rng = SeedTree::new(1).rng();
    let side = (n as f32 / 300.0).sqrt();
    let points: Vec<Vec3> = (0..n)
        .map(|_| {
            let (x, y) = (rng.random::<f32>() * side, rng.random::<f32>() * side);
            Vec3::new(x, y, (x * 3.0).sin() * (y * 2.0).cos() + 0.02 * rng.random::<f32>())
        })
        .collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let clock = Instant::now();
    let table = pool.install(|| knn(&points, k));
    let ours = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let entries: Vec<[f32; 3]> = points.iter().map(Vec3::to_array).collect();
    let tree = ImmutableKdTree::new_from_slice(&entries).expect("distinct points");
    let mut differ = 0;
    for (i, p) in entries.iter().enumerate() {
        let found = tree
            .query(p)
            .nearest_n::<SquaredEuclidean<f32>>(NonZero::new(k).expect("80"))
            .execute();
        differ += usize::from(found.iter().zip(table.row(i)).any(|(f, &j)| f.item != j));
    }
    let kiddo = clock.elapsed().as_secs_f64();
    println!(
        "{n} points, k = {k}: ours {ours:.3} s, kiddo {kiddo:.3} s, ratio {:.2}; {differ} rows differ",
        kiddo / ours
    );
}
