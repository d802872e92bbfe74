//! Hostile folders: a site and a run of it, one file damaged at a time, through everything that reads them. A named error or a
//! result; never a panic. `TSUMU_MUTANTS=20000` for hours of it.

mod before;
#[path = "../../../io/tests/hostile/damage.rs"]
mod damage;
mod folders;

use folders::Depth;
use geom::SeedTree;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};

fn mutants(usual: u64) -> u64 {
    std::env::var("TSUMU_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
}

/// Counts what became of mutants.
#[derive(Default)]
struct Told {
    tried: u64,
    refused: u64,
}

impl Told {
    #[track_caller]
    fn hear(&mut self, what: &str, work: impl FnOnce() -> tsumu::Result<()>) {
        self.tried += 1;
        match catch_unwind(AssertUnwindSafe(work)) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => {
                self.refused += 1;
                let line = error.line();
                assert!(!line.is_empty() && !line.contains('\n'), "{what}: {line}");
            }
            Err(_) => panic!("a panic at {what}"),
        }
    }
}

#[test]
fn no_damage_of_a_run_folder_ends_in_a_panic() {
    let site_folder = folders::site_folder();
    let run = folders::run_of(site_folder.path());
    let targets = folders::read_again(&run);
    assert!(targets.len() >= 8, "{targets:?}");
    let mut told = Told::default();
    for i in 0..mutants(240) {
        let name = &targets[(i % targets.len() as u64) as usize];
        let tree = SeedTree::new(22).child("run", i);
        let mutant = damage::damaged(&fs::read(run.join(name)).unwrap(), tree.child("damage", 0));
        let by_hand =
            !(i / targets.len() as u64).is_multiple_of(4) && !name.ends_with("manifest.json");
        let depth = if i % 5 == 2 { Depth::End } else { Depth::Read };
        told.hear(&format!("mutant {i} of {}", name.display()), || {
            folders::through_a_run(site_folder.path(), (name, &mutant), by_hand, depth)
        });
    }
    println!("{} mutants of a run folder, {} refused", told.tried, told.refused);
    assert!(told.refused > told.tried / 4, "{} of {}", told.refused, told.tried);
}

#[test]
fn no_damage_of_a_site_ends_in_a_panic() {
    let site_folder = folders::site_folder();
    let mut told = Told::default();
    let all = folders::names(site_folder.path());
    assert_eq!(all.len(), 3, "{all:?}");
    for i in 0..mutants(240) {
        let name = &all[(i % 3) as usize];
        let own = fs::read(site_folder.path().join(name)).unwrap();
        let tree = SeedTree::new(23).child("site", i);
        let mutant = damage::damaged(&own, tree.child("damage", 0));
        // A damaged survey is recognised like any other; every eighth to its end.
        let depth = match i % 8 {
            0 => Depth::End,
            4 => Depth::Recognise,
            _ => Depth::Read,
        };
        told.hear(&format!("mutant {i} of {}", name.display()), || {
            folders::through_a_site(site_folder.path(), (name, &mutant), depth)
        });
    }
    println!("{} mutants of a site, {} refused", told.tried, told.refused);
    assert!(told.refused > told.tried / 4, "{} of {}", told.refused, told.tried);
}
