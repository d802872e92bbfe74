//! Points that hang together by steps shorter than a radius.

use geom::{PointGrid, Vec3};

/// Connected groups of at least `least` points, each ascending; `member` says which points take part.
pub(crate) fn connected(
    position: &[Vec3],
    member: &[bool],
    radius: f32,
    least: usize,
) -> Vec<Vec<u32>> {
    let grid = PointGrid::new(position, radius);
    let mut seen = vec![false; position.len()];
    let mut groups = Vec::new();
    for start in 0..position.len() {
        if seen[start] || !member[start] {
            continue;
        }
        seen[start] = true;
        let mut group = vec![start as u32];
        let mut next = 0;
        while next < group.len() {
            let at = position[group[next] as usize];
            next += 1;
            grid.for_each_within(at, radius, |i, _, _| {
                if member[i as usize] && !std::mem::replace(&mut seen[i as usize], true) {
                    group.push(i);
                }
            });
        }
        if group.len() >= least {
            group.sort_unstable();
            groups.push(group);
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_are_groups_and_strays_are_none() {
        let position: Vec<Vec3> =
            [0.0, 0.9, 1.8, 5.0, 5.5, 9.0].iter().map(|x| Vec3::X * *x).collect();
        let groups = connected(&position, &[true; 6], 1.0, 2);
        assert_eq!(groups, vec![vec![0, 1, 2], vec![3, 4]]);
        let without = [true, false, true, true, true, true];
        assert_eq!(connected(&position, &without, 1.0, 2), vec![vec![3, 4]]);
    }
}
