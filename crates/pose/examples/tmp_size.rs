use geom::{Event, Observer, PointCloud, SeedTree, Vec3, Warning};
use pose::size_search::{SizeSearch, fit_block_size};
struct Say;
impl Observer for Say {
    fn event(&self, e: Event) {
        if let Event::Noted { message, .. } = e {
            eprintln!("{message}")
        }
    }
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&a[1]).unwrap();
    let p: Vec<Vec3> = text
        .lines()
        .map(|l| {
            let v: Vec<f32> = l.split_whitespace().map(|x| x.parse().unwrap()).collect();
            Vec3::new(v[0], v[1], v[2])
        })
        .collect();
    let size: f32 = 2.0;
    let shape = match a[2].as_str() {
        "cube" => scene::Shape::Cube { size },
        "dolos" => scene::Shape::Dolos { size },
        "antifer" => scene::Shape::Antifer { size },
        _ => scene::Shape::Tetrapod { size },
    };
    let catalog = scene::Catalog::new(vec![blocks::shape_model("b", shape, 2300.0).unwrap()]);
    let survey = scene::Survey { cloud: PointCloud::from_positions(p), ..Default::default() };
    let noise: f32 = a[3].parse().unwrap();
    let mut s = SizeSearch::default();
    if a.len() > 5 {
        s.least_m = a[4].parse().unwrap();
        s.most_m = a[5].parse().unwrap();
    }
    let found =
        fit_block_size(&survey, &catalog, noise, &s, &Default::default(), SeedTree::new(1), &Say)
            .unwrap();
    for f in found {
        println!(
            "size {:.3} ± {:.3} ({} blocks) explained {:.3} found {}",
            2.0 * f.scale.factor,
            2.0 * f.scale.factor_sd,
            f.scale.blocks,
            f.explained,
            f.found
        );
    }
    let _: Option<Warning> = None;
}
