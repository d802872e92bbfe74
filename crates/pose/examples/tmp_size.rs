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
    if a[2] == "facts" {
        let survey = scene::Survey { cloud: PointCloud::from_positions(p), ..Default::default() };
        let f = pose::survey_facts::SurveyFacts::of(&survey, 1.29);
        println!(
            "{} uneven {:.1} dup {:.2} lattice {:?} regions {:?}",
            f.sentence(),
            f.unevenness,
            f.duplicates,
            f.lattice,
            f.scatter.regions.iter().map(|r| (r.scatter_m * 1e3).round()).collect::<Vec<_>>()
        );
        let m = blocks::shape_model("b", scene::Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap();
        for l in f.limits(&m) {
            println!("  LIMIT {l}");
        }
        if let (Some(l), Some(out)) = (&f.lattice, a.get(3)) {
            let g = pose::gridded::Gridded::new(&survey, l);
            println!("  grid error {:.3} kept {} of {}", g.error_rms_m(), g.index.len(), f.points);
            let text: String = g
                .survey
                .cloud
                .position_m
                .iter()
                .map(|p| format!("{} {} {}\n", p.x, p.y, p.z))
                .collect();
            std::fs::write(out, text).unwrap();
        }
        return;
    }
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
