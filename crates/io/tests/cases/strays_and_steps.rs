//! Points far from all others, and numbers stored in coarse steps.

use crate::las_file::Las;
use crate::{heap, read};
use geom::{DVec3, strays};

#[test]
fn stray_1km_and_further() {
    for far in [
        DVec3::new(42_250.0, -98_760.0, 2.0),
        DVec3::new(44_250.0, -98_760.0, 2.0),
        DVec3::new(61_250.0, -98_760.0, 2.0),
        DVec3::ZERO,
    ] {
        let mut points = heap(3000);
        points.push(far);
        let found = strays(&points);
        assert_eq!(found.index, [3000]);
        assert!(found.describe().contains(&format!("{:.1}", far.x)), "{}", found.describe());
    }
}

#[test]
fn nodata_minus_9999() {
    for hole in [-9999.0, -32768.0, 9999.0, 1e20] {
        let mut points = heap(3000);
        [100, 200, 300].iter().for_each(|&i| points[i].z = hole);
        let found = strays(&points);
        assert_eq!(found.index, [100, 200, 300], "{hole}");
    }
}

#[test]
fn scale_0_1() {
    let said = |scale: f64| {
        let las = Las { scale, ..Las::default() };
        read(
            "las",
            &las.bytes(&heap(500).iter().map(|p| las.record(*p, 2, 0, 0)).collect::<Vec<_>>()),
        )
        .unwrap()
        .1
    };
    assert!(said(0.1).contains("steps of 0.1"), "{}", said(0.1));
    assert!(said(0.25).contains("steps of 0.25"));
    assert!(!said(0.01).contains("steps") && !said(0.001).contains("steps"));
    // The same in a text of one decimal.
    let text: String =
        heap(500).iter().map(|p| format!("{:.1} {:.1} {:.1}\n", p.x, p.y, p.z)).collect();
    assert!(read("xyz", text.as_bytes()).unwrap().1.contains("steps of 0.1"));
    // A grid of 0.5 m with heights in millimetres has lost nothing.
    let grid: String = (0..400)
        .map(|i| {
            format!(
                "{} {} {:.3}\n",
                f64::from(i % 20) * 0.5,
                f64::from(i / 20) * 0.5,
                f64::from(i).sin()
            )
        })
        .collect();
    assert!(!read("xyz", grid.as_bytes()).unwrap().1.contains("steps"));
}
