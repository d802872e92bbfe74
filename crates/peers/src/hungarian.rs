//! The cheapest way to give every row a column of its own (Kuhn 1955, in the form of Jonker and Volgenant 1987).

/// Column of each row; there must be at least as many columns as rows.
pub(crate) fn assign(cost: &[Vec<f64>]) -> Vec<usize> {
    let rows = cost.len();
    let columns = cost.first().map_or(0, Vec::len);
    assert!(columns >= rows, "a column for every row");
    // Numbered from 1; 0 is nobody.
    let (mut u, mut v) = (vec![0.0; rows + 1], vec![0.0; columns + 1]);
    let mut row_of = vec![0_usize; columns + 1];
    let mut from = vec![0_usize; columns + 1];
    for row in 1..=rows {
        row_of[0] = row;
        let mut at = 0;
        let mut least = vec![f64::INFINITY; columns + 1];
        let mut used = vec![false; columns + 1];
        loop {
            used[at] = true;
            let (r, mut delta, mut next) = (row_of[at], f64::INFINITY, 0);
            for c in (1..=columns).filter(|&c| !used[c]).collect::<Vec<_>>() {
                let reduced = cost[r - 1][c - 1] - u[r] - v[c];
                if reduced < least[c] {
                    (least[c], from[c]) = (reduced, at);
                }
                if least[c] < delta {
                    (delta, next) = (least[c], c);
                }
            }
            for c in 0..=columns {
                if used[c] {
                    u[row_of[c]] += delta;
                    v[c] -= delta;
                } else {
                    least[c] -= delta;
                }
            }
            at = next;
            if row_of[at] == 0 {
                break;
            }
        }
        while at != 0 {
            row_of[at] = row_of[from[at]];
            at = from[at];
        }
    }
    let mut column = vec![0; rows];
    for c in 1..=columns {
        if row_of[c] > 0 {
            column[row_of[c] - 1] = c - 1;
        }
    }
    column
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;
    use rand::RngExt;

    fn cheapest(cost: &[Vec<f64>], row: usize, taken: &mut Vec<bool>) -> f64 {
        if row == cost.len() {
            return 0.0;
        }
        let mut best = f64::INFINITY;
        for c in 0..taken.len() {
            if !taken[c] {
                taken[c] = true;
                best = best.min(cost[row][c] + cheapest(cost, row + 1, taken));
                taken[c] = false;
            }
        }
        best
    }

    #[test]
    fn as_cheap_as_trying_everything() {
        let mut rng = SeedTree::new(2).rng();
        for (rows, columns) in [(1, 1), (3, 3), (3, 6), (5, 6)] {
            for _ in 0..20 {
                let cost: Vec<Vec<f64>> =
                    (0..rows).map(|_| (0..columns).map(|_| rng.random()).collect()).collect();
                let found = assign(&cost);
                let sum: f64 = found.iter().enumerate().map(|(r, c)| cost[r][*c]).sum();
                let mut distinct = found.clone();
                distinct.sort_unstable();
                distinct.dedup();
                assert_eq!(distinct.len(), rows);
                assert!((sum - cheapest(&cost, 0, &mut vec![false; columns])).abs() < 1e-9);
            }
        }
        assert!(assign(&[]).is_empty());
    }
}
