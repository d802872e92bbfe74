//! The stage from outside: piles it must find, seams it must not show, input it must survive.

use geom::{Event, Observer, PointCloud, SeedTree, Silent, Vec3};
use metrics::{InstanceScene, precision_recall};
use scene::{Catalog, Segmentation, Shape};
use segment::{Clustering, SegmentConfig, SegmentError, SegmentModel, segment};
use std::sync::Mutex;
use synth::{Recipe, SynthScene};

fn tetrapods(size: f32) -> Catalog {
    Catalog::new(vec![blocks::shape_model("tetrapod", Shape::Tetrapod { size }, 2300.0).unwrap()])
}

fn pile(catalog: &Catalog, text: &str) -> SynthScene {
    let text = format!("name = \"test\"\n{text}\n[sensor]\nkind = \"gaussian\"\n");
    synth::scene(&Recipe::parse(&text).unwrap(), catalog, SeedTree::new(5)).unwrap()
}

fn run(
    cloud: &PointCloud,
    catalog: &Catalog,
    config: &SegmentConfig,
) -> Result<Segmentation, SegmentError> {
    let model = SegmentModel::shipped(catalog).unwrap();
    segment(cloud, catalog, &model, config, SeedTree::new(1), &Silent)
}

fn check(result: &Segmentation, points: usize) {
    assert_eq!(result.instance.len(), points);
    assert_eq!(result.confidence.len(), points);
    assert!(result.instances <= result.hypotheses.len());
    assert!(result.instance.iter().all(|&i| i as usize <= result.instances));
    assert!(result.confidence.iter().all(|c| (0.0..=1.0).contains(c)));
    for (h, hypothesis) in result.hypotheses.iter().enumerate() {
        assert!(hypothesis.centre.is_finite() && hypothesis.score > 0.0 && hypothesis.score <= 1.0);
        assert!(hypothesis.points.windows(2).all(|w| w[0] < w[1]));
        if h < result.instances {
            assert!(!hypothesis.points.is_empty());
            assert!(hypothesis.points.iter().all(|&i| result.instance[i as usize] == h as u32 + 1));
        }
    }
}

#[test]
fn finds_the_blocks_of_a_pile_at_any_size_and_thread_count() {
    let catalog = tetrapods(2.0);
    let made = pile(
        &catalog,
        "density_per_m2 = 400\ncount = [18, 18]\nsite = { kind = \"pen\", side_blocks = 4.0 }",
    );
    let cloud = &made.survey.cloud;
    let result = run(cloud, &catalog, &SegmentConfig::default()).unwrap();
    check(&result, cloud.len());
    let truth = InstanceScene { predicted: &result.instance, truth: &made.instance };
    let counts = precision_recall(&[truth], 0.5).unwrap();
    assert!(counts.recall().unwrap() > 0.75 && counts.precision().unwrap() > 0.7, "{counts:?}");

    // A tenth of the size is the same problem: the network sees units of the block.
    let small = PointCloud::from_positions(cloud.position_m.iter().map(|p| *p * 0.1).collect());
    let again = run(&small, &tetrapods(0.2), &SegmentConfig::default()).unwrap();
    let same = InstanceScene { predicted: &again.instance, truth: &result.instance };
    assert!(precision_recall(&[same], 0.8).unwrap().recall().unwrap() > 0.9);

    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| run(cloud, &catalog, &SegmentConfig::default())).unwrap(), result);

    let config = SegmentConfig { clustering: Clustering::Embedding, ..Default::default() };
    check(&run(cloud, &catalog, &config).unwrap(), cloud.len());
}

#[test]
fn a_seam_between_tiles_does_not_show() {
    let catalog = tetrapods(1.0);
    let made = pile(
        &catalog,
        "density_per_m2 = 900\ncount = [40, 40]\nsite = { kind = \"strip\", length_m = 16.0, width_m = 4.0 }",
    );
    let cloud = &made.survey.cloud;
    let config = SegmentConfig { passes: 1, ..Default::default() };
    let whole = run(cloud, &catalog, &config).unwrap();
    // The strip is about 25 d_max long, two tiles; its middle third alone is one.
    let middle: Vec<usize> =
        (0..cloud.len()).filter(|&i| cloud.position_m[i].x.abs() < 4.5).collect();
    let alone = run(&cloud.select(&middle), &catalog, &config).unwrap();
    let near_seam: Vec<usize> =
        (0..middle.len()).filter(|&k| cloud.position_m[middle[k]].x.abs() < 1.5).collect();
    let predicted: Vec<u32> = near_seam.iter().map(|&k| whole.instance[middle[k]]).collect();
    let truth: Vec<u32> = near_seam.iter().map(|&k| alone.instance[k]).collect();
    let counts =
        precision_recall(&[InstanceScene { predicted: &predicted, truth: &truth }], 0.8).unwrap();
    assert!(counts.recall().unwrap() > 0.85 && counts.precision().unwrap() > 0.85, "{counts:?}");
    for (i, a) in whole.hypotheses[..whole.instances].iter().enumerate() {
        for b in &whole.hypotheses[..i] {
            assert!((a.centre - b.centre).length() > 0.3, "one block twice");
        }
    }
}

#[test]
fn strange_clouds_are_survived() {
    let catalog = tetrapods(2.0);
    let config = SegmentConfig::default();
    let embedding = SegmentConfig { clustering: Clustering::Embedding, ..Default::default() };
    let sheet =
        (0..900).map(|i| Vec3::new((i % 30) as f32 * 0.1, (i / 30) as f32 * 0.1, 0.0)).collect();
    let clouds: Vec<Vec<Vec3>> = vec![
        Vec::new(),
        vec![Vec3::ZERO],
        vec![Vec3::ONE; 50],
        (0..30).map(|i| Vec3::X * i as f32 * 0.2).collect(),
        sheet,
        vec![Vec3::ZERO, Vec3::splat(4e5), Vec3::splat(-4e5)],
    ];
    for positions in clouds {
        let cloud = PointCloud::from_positions(positions);
        for config in [&config, &embedding] {
            check(&run(&cloud, &catalog, config).unwrap(), cloud.len());
        }
    }
}

#[test]
fn bad_input_is_named() {
    let cloud = PointCloud::from_positions(vec![Vec3::ZERO, Vec3::new(1.0, f32::NAN, 0.0)]);
    let catalog = tetrapods(2.0);
    let config = SegmentConfig::default();
    assert_eq!(run(&cloud, &catalog, &config).unwrap_err(), SegmentError::NotFinite { point: 1 });
    assert_eq!(run(&cloud, &Catalog::default(), &config).unwrap_err(), SegmentError::EmptyCatalog);
    let wrong = SegmentConfig { passes: 0, ..Default::default() };
    assert!(matches!(
        run(&cloud, &catalog, &wrong),
        Err(SegmentError::Setting { name: "passes", .. })
    ));
    assert!(matches!(SegmentModel::from_bytes(b"not a model"), Err(SegmentError::Weights(_))));
    let mut bytes = SegmentModel::shipped(&catalog).unwrap().to_bytes().unwrap();
    let at = bytes.windows(7).position(|w| w == b"fpccv2\"").unwrap();
    bytes[at..at + 6].copy_from_slice(b"resnet");
    assert_eq!(
        SegmentModel::from_bytes(&bytes).unwrap_err(),
        SegmentError::Architecture { found: "resnet".into() }
    );
    assert!(matches!(
        SegmentModel::load("nowhere.safetensors".as_ref()),
        Err(SegmentError::File { .. })
    ));
}

#[derive(Default)]
struct Heard(Mutex<Vec<Event>>);

impl Observer for Heard {
    fn event(&self, event: Event) {
        self.0.lock().unwrap().push(event);
    }
}

#[test]
fn a_catalogue_ten_times_too_big_warns_or_finds_little() {
    let made = pile(
        &tetrapods(1.0),
        "density_per_m2 = 400\ncount = [10, 10]\nsite = { kind = \"pen\", side_blocks = 4.0 }",
    );
    let catalog = tetrapods(10.0);
    let heard = Heard::default();
    let model = SegmentModel::shipped(&catalog).unwrap();
    let cloud = &made.survey.cloud;
    let result =
        segment(cloud, &catalog, &model, &SegmentConfig::default(), SeedTree::new(1), &heard)
            .unwrap();
    check(&result, cloud.len());
    let warned = heard.0.lock().unwrap().iter().any(|e| matches!(e, Event::Warned(_)));
    assert!(warned || result.instances <= 2, "{} instances", result.instances);
}

#[test]
fn a_cancelled_run_says_so() {
    struct Stop;
    impl Observer for Stop {
        fn event(&self, _event: Event) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let catalog = tetrapods(2.0);
    let model = SegmentModel::shipped(&catalog).unwrap();
    let cloud = PointCloud::from_positions(vec![Vec3::ZERO; 3]);
    let result =
        segment(&cloud, &catalog, &model, &SegmentConfig::default(), SeedTree::new(1), &Stop);
    assert_eq!(result.unwrap_err(), SegmentError::Cancelled);
}
