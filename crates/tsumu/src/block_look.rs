//! What a check can only tell from the points at their own density: spacing, noise, grid, and whether the blocks are as large as the
//! catalogue says.
//!
//! A survey of any size is asked in one window with much relief.

use crate::block_size::{entry_sizes_m, length_text};
use crate::surveys::{self, Joined};
use crate::{Job, Settings, catalogue};
use geom::{DVec3, Silent, Vec3};
use io::site::Site;
use pipeline::sizes::{
    REFUSED_FROM, SizeProposal, SizeSearch, WARNED_FROM, fit_sizes, relief_m, stated_blocks,
    windows,
};
use pipeline::survey::{Limit, SurveyFacts, not_judgeable};
use preflight::{Preflight, SizeLook, SurfaceLook, SurveyLook, Texture};
use scene::{Area, BlockModel, Catalog, CatalogSpec, Complaint, Survey};
use std::collections::BTreeMap;
use std::path::Path;

/// Points that are looked at.
const POINTS: usize = 200_000;
/// Sizes are sought from this factor on the catalogue's to its inverse.
const REACH: f32 = 1.7;
/// Places searched for each size: fewer than `tsumu blocks fit` takes, so that a check stays quick.
const PLACES: usize = 10;
/// Another size is believed from so many blocks and this explained share on.
const FEWEST_BLOCKS: usize = 3;
const LEAST_EXPLAINED: f32 = 0.15;
/// The catalogue's size holds when it explains this share of what the best size explains.
const AS_GOOD: f32 = 0.8;

/// Looks at the points of a site that can be answered so far; what is found joins the complaints.
pub(crate) fn look_closely(folder: &Path, found: &mut Preflight, job: &Job) {
    let Ok(site) = io::site::load(folder) else { return };
    let spec = site.catalog.clone();
    let Ok(catalog) = catalogue::models(&spec, &site.catalog_file, &Silent) else { return };
    let Some(survey) = part(site, found) else { return };
    let smallest = catalog.iter().map(|(_, m)| m).min_by(|a, b| a.d_box_m.total_cmp(&b.d_box_m));
    let Some(smallest) = smallest else { return };
    let file = found.surveys.first().map(|s| s.file.clone()).unwrap_or_default();
    let facts = SurveyFacts::of(&survey, smallest.d_max_m);
    let texture = Texture::of(&survey.cloud.position_m, smallest.d_box_m);
    texture_complaints(&texture, &file, found);
    let hopeless = limit_complaints(&facts, &catalog, &file, found);
    found.surface = Some(SurfaceLook {
        points: facts.points,
        spacing_m: facts.spacing_m,
        scatter_m: facts.scatter.overall_m,
        grid_cell_m: facts.lattice.as_ref().map(|l| l.cell_m),
        texture,
        sentence: facts.sentence(),
    });
    if !hopeless {
        sizes(&survey, (&spec, &catalog), &file, found, job);
    }
    found.conclude();
}

/// The surveys, or a window of them that holds some 200,000 points.
fn part(mut site: Site, found: &Preflight) -> Option<Survey> {
    let all: u64 = found.surveys.iter().map(|s| s.points).sum();
    if !found.surveys.iter().all(|s| s.whole) || all > 10 * POINTS as u64 {
        let largest = found.surveys.iter().max_by_key(|s| s.points)?;
        site.spec.area = Some(window(largest)?);
    }
    let Joined { survey, .. } = surveys::of_site(&site, &Silent).ok()?;
    Some(windows(&survey, POINTS))
}

/// Of all squares this share has less relief than the one that is looked at: piles may be a small part of a harbour, and the
/// very highest are walls and trees.
const RANK: f32 = 0.97;

/// A square of the survey with more relief about its own plane than most.
fn window(look: &SurveyLook) -> Option<Area> {
    let side = (POINTS as f64 / look.density_per_m2).sqrt();
    let corner = DVec3::from_array(look.low);
    let mut cells: BTreeMap<[i64; 2], Vec<Vec3>> = BTreeMap::new();
    for p in &look.sample {
        let at = *p - corner;
        let key = [at.x / side, at.y / side].map(|v| v.floor() as i64);
        cells.entry(key).or_default().push(at.as_vec3());
    }
    let full = cells.values().map(Vec::len).max()?;
    let mut relief: Vec<(f32, [i64; 2])> = cells
        .into_iter()
        .filter(|(_, points)| 2 * points.len() >= full)
        .map(|(cell, points)| (relief_m(&points, side as f32), cell))
        .collect();
    relief.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let rank = (RANK * relief.len().saturating_sub(1) as f32).round() as usize;
    let (_, [i, j]) = *relief.get(rank)?;
    let (west, south) = (corner.x + i as f64 * side, corner.y + j as f64 * side);
    Some(Area { west, east: west + side, south, north: south + side })
}

fn texture_complaints(texture: &Texture, file: &str, found: &mut Preflight) {
    if texture.scattered_share > 0.3 {
        let text = format!(
            "{:.0} % of the points looked at lie on no surface: vegetation, spray or noise",
            100.0 * texture.scattered_share
        );
        let advice = "clean the survey, or leave classes out with leave_out";
        found.complaints.push(Complaint::warning("scattered", file, text, advice));
    }
    if texture.flat_share > 0.8 {
        let text = format!(
            "{:.0} % of the points looked at lie on planes wider than two blocks: bed, walls or water",
            100.0 * texture.flat_share
        );
        let advice = "see that the pile itself is surveyed";
        found.complaints.push(Complaint::warning("flat", file, text, advice));
    }
}

/// What keeps blocks from being judged; whether that is so for every type, whatever one does.
fn limit_complaints(
    facts: &SurveyFacts,
    catalog: &Catalog,
    file: &str,
    found: &mut Preflight,
) -> bool {
    let doubtful = not_judgeable(facts, catalog);
    let stops = |l: &Limit| matches!(l, Limit::Unit(_) | Limit::Cell { .. });
    let hopeless = doubtful.iter().filter(|(_, l)| l.iter().any(stops)).count() == catalog.len();
    for (model, limits) in doubtful {
        for limit in limits {
            let text = format!("`{}`: {limit}", model.name);
            found.complaints.push(if hopeless && stops(&limit) {
                let advice = "survey again with smaller cells, or check size and unit";
                Complaint::refusal("limit", file, text, advice)
            } else {
                let advice = "few or none will be stated";
                Complaint::warning("limit", file, text, advice)
            });
        }
    }
    hopeless
}

/// What a fitted size says of the catalogue's.
enum Told {
    /// The survey shows the catalogue's size.
    Right,
    /// One that is worth a warning.
    Slightly,
    /// Another one.
    Wrong,
    /// Something fits another size best, and few of its blocks are sure: no pile of such blocks.
    Nothing,
}

/// Whether the blocks are as large as the catalogue says.
fn sizes(
    survey: &Survey,
    (spec, catalog): (&CatalogSpec, &Catalog),
    file: &str,
    found: &mut Preflight,
    job: &Job,
) {
    let mut wrong = Vec::new();
    let mut right = false;
    let entry_m = entry_sizes_m(spec, catalog);
    for (id, model) in catalog.iter() {
        let entry_m = entry_m[usize::from(id.0)];
        let Some((look, told)) = size_look(survey, model, entry_m, job) else {
            let text = format!(
                "no block like `{}` of {:.2} to {:.2} m was found in the part looked at",
                model.name,
                entry_m / REACH,
                entry_m * REACH
            );
            found.complaints.push(Complaint::note("size", file, text));
            continue;
        };
        right |= matches!(told, Told::Right | Told::Slightly);
        let complaint = match told {
            Told::Right => Complaint::note("size", file, sentence(&look)),
            Told::Slightly => {
                let advice = "hold it against drawing and unit";
                Complaint::warning("size", file, sentence(&look), advice)
            }
            Told::Nothing => {
                let text = format!("{}, and fewer than half of them are sure", sentence(&look));
                let advice =
                    "see that the pile itself is surveyed, and hold the size against the drawing";
                found.complaints.push(Complaint::warning("size", file, text, advice));
                continue;
            }
            Told::Wrong => {
                wrong.push(look.clone());
                found.sizes.push(look);
                continue;
            }
        };
        found.complaints.push(complaint);
        found.sizes.push(look);
    }
    for look in wrong {
        // Where another type fits as it is, this one may merely not be there.
        found.complaints.push(if right {
            Complaint::warning("size", file, sentence(&look), "is this type in the pile at all?")
        } else {
            let advice = "with this size no block would be stated: correct the catalogue";
            Complaint::refusal("size", file, sentence(&look), advice)
        });
    }
}

/// The size of a type that the survey shows: the catalogue's own where that is as good as any; `None` without blocks enough.
fn likeliest(survey: &Survey, model: &BlockModel, job: &Job) -> Option<SizeProposal> {
    let alone = Catalog::new(vec![model.clone()]);
    let search = SizeSearch {
        least_m: model.d_box_m / REACH,
        most_m: model.d_box_m * REACH,
        places: PLACES,
        ..SizeSearch::default()
    };
    let config = Settings::default().alone().ok()?;
    let fits = job.install(|| fit_sizes(survey, &alone, &search, &config.pose, &Silent)).ok()?;
    let best = fits.first()?;
    if best.found < FEWEST_BLOCKS || best.explained < LEAST_EXPLAINED {
        return None;
    }
    let own = |p: &&SizeProposal| p.scale.deviation() < REFUSED_FROM;
    let own = fits.iter().find(own).filter(|p| p.explained >= AS_GOOD * best.explained);
    Some(own.unwrap_or(best).clone())
}

/// How large the blocks of a type are, and what that says of the catalogue; `None` without blocks enough.
fn size_look(
    survey: &Survey,
    model: &BlockModel,
    entry_m: f32,
    job: &Job,
) -> Option<(SizeLook, Told)> {
    let best = likeliest(survey, model, job)?;
    let (factor, off) = (best.scale.factor, best.scale.deviation());
    let stated = (off >= WARNED_FROM).then(|| stated_of(survey, &model.scaled(factor), job));
    let told = match stated {
        None => Told::Right,
        // Smooth ground states some of the blocks that fit it best; of blocks that are there most are sure.
        Some(stated) if stated < FEWEST_BLOCKS.max(best.found.div_ceil(2)) => Told::Nothing,
        Some(_) if off < REFUSED_FROM => Told::Slightly,
        Some(_) => Told::Wrong,
    };
    let look = SizeLook {
        block: model.name.clone(),
        catalogue_m: entry_m,
        fits_m: factor * entry_m,
        fits_sd_m: best.scale.factor_sd * entry_m,
        explained: best.explained,
        found: best.found,
        stated,
    };
    Some((look, told))
}

/// Blocks of a size that would be stated; none where they cannot be sought.
fn stated_of(survey: &Survey, model: &BlockModel, job: &Job) -> usize {
    let Ok(config) = Settings::default().alone() else { return 0 };
    job.install(|| stated_blocks(survey, model, &config, &Silent)).unwrap_or(0)
}

/// `fits 2.79 ± 0.01 m; the catalogue says 2.00`.
fn sentence(look: &SizeLook) -> String {
    format!(
        "`{}` fits {} ± {} m over {} blocks; the catalogue says {}",
        look.block,
        length_text(look.fits_m, look.fits_m),
        length_text(look.fits_sd_m, look.fits_m),
        look.found,
        length_text(look.catalogue_m, look.fits_m)
    )
}
