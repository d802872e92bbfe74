//! Polygons in space as triangles, concave ones too.

use geom::DVec3;

/// Triangles of a polygon, as places in its outline, turned as the outline is. Outlines of no area give none.
pub fn triangles(outline: &[DVec3]) -> Vec<[usize; 3]> {
    match outline.len() {
        0..3 => return Vec::new(),
        3 => return vec![[0, 1, 2]],
        4 if is_convex(outline) => return vec![[0, 1, 2], [0, 2, 3]],
        _ => {}
    }
    // Seen along the axis nearest to its normal, near the origin, so that large coordinates cost no digits.
    let normal = normal(outline);
    if !(normal.length_squared() > 0.0 && normal.is_finite()) {
        return Vec::new();
    }
    let away = normal.abs();
    let [u, v] = if away.z >= away.x && away.z >= away.y {
        [0, 1]
    } else if away.y >= away.x {
        [2, 0]
    } else {
        [1, 2]
    };
    let near = outline.iter().map(|p| *p - outline[0]);
    let plane: Vec<f64> = near.flat_map(|p| [p[u], p[v]]).collect();
    let out = earcutr::earcut(&plane, &[], 2).unwrap_or_default();
    let turned = |t: &[usize]| {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| outline[i]);
        if (b - a).cross(c - a).dot(normal) < 0.0 { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] }
    };
    out.chunks_exact(3).map(turned).collect()
}

/// Twice the area, by Newell.
fn normal(outline: &[DVec3]) -> DVec3 {
    let next = |i: usize| outline[(i + 1) % outline.len()];
    (0..outline.len()).map(|i| (outline[i] - outline[0]).cross(next(i) - outline[0])).sum()
}

fn is_convex(outline: &[DVec3]) -> bool {
    let (n, normal) = (outline.len(), normal(outline));
    (0..n).all(|i| {
        let [a, b, c] = [0, 1, 2].map(|k| outline[(i + k) % n]);
        (b - a).cross(c - b).dot(normal) > 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let of = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| outline[i]);
            (b - a).cross(c - a).z / 2.0
        };
        triangles.iter().map(of).sum()
    }

    #[test]
    fn concave_outlines_keep_their_area_and_their_turn() {
        let l = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        for shift in [0.0, 41_250.0] {
            let mut outline: Vec<DVec3> =
                l.iter().map(|&(x, y)| DVec3::new(x + shift, y - shift, shift)).collect();
            for start in 0..outline.len() {
                outline.rotate_left(1);
                let found = triangles(&outline);
                assert_eq!(found.len(), 4, "{start}");
                assert!((area(&outline, &found) - 4.0).abs() < 1e-6);
            }
            outline.reverse();
            assert!((area(&outline, &triangles(&outline)) + 4.0).abs() < 1e-6);
        }
    }

    #[test]
    fn an_arrow_of_four_corners_is_cut_at_its_notch() {
        let arrow =
            [(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.5, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        for turn in 0..4 {
            let mut outline = arrow;
            outline.rotate_left(turn);
            let found = triangles(&outline);
            assert!((area(&outline, &found) - 1.5).abs() < 1e-9 && found.len() == 2);
            let each = |t: &[usize; 3]| area(&outline, &[*t]) > 0.0;
            assert!(found.iter().all(each), "a triangle outside the outline");
        }
    }

    #[test]
    fn outlines_without_area_give_nothing() {
        assert!(triangles(&[DVec3::ZERO; 5]).is_empty());
        assert!(triangles(&[DVec3::ZERO, DVec3::X]).is_empty());
    }
}
