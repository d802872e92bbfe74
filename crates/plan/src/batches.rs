//! Windows that can be worked on at the same time without changing the result.
//!
//! In: places in the order in which they are to be served. Out: batches; a place comes in the batch after the last
//! earlier place within `radius_m`, so running batch by batch equals running one by one in order, whatever the number of threads.

use geom::Vec2;

/// Indices of the places, batch by batch, ascending within each.
pub(crate) fn independent(places: &[Vec2], radius_m: f32) -> Vec<Vec<usize>> {
    let mut level = vec![0_usize; places.len()];
    let mut batches: Vec<Vec<usize>> = Vec::new();
    for (i, place) in places.iter().enumerate() {
        let conflicts = (0..i).filter(|&j| (places[j] - *place).length() < radius_m);
        level[i] = conflicts.map(|j| level[j] + 1).max().unwrap_or(0);
        if level[i] == batches.len() {
            batches.push(Vec::new());
        }
        batches[level[i]].push(i);
    }
    batches
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn neighbours_keep_their_order(places in prop::collection::vec((0.0f32..50.0, 0.0f32..10.0), 0..60)) {
            let places: Vec<Vec2> = places.into_iter().map(|(x, y)| Vec2::new(x, y)).collect();
            let batches = independent(&places, 6.0);
            let batch_of = |i: usize| batches.iter().position(|b| b.contains(&i)).unwrap();
            prop_assert_eq!(batches.iter().map(Vec::len).sum::<usize>(), places.len());
            for i in 0..places.len() {
                for j in 0..i {
                    if (places[i] - places[j]).length() < 6.0 {
                        prop_assert!(batch_of(j) < batch_of(i));
                    }
                }
            }
        }
    }
}
