//! Labels a survey in its own records: `relabel IN OUT`. Point i gets block `i % 7`; for readers of other makes to look at.

use io::relabel::{self, PointLabels, Records, SiteFromFile};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = arguments.as_slice() else { return Err("usage: relabel IN OUT".into()) };
    let (from, to) = (Path::new(from), Path::new(to));
    let cloud = io::points::read(from, &geom::Silent)?;
    let record = cloud.record.unwrap_or_default();
    let labels = PointLabels {
        instance: &record.iter().map(|r| r % 7).collect::<Vec<_>>(),
        model: &vec![1; record.len()],
        confidence: &vec![0.5; record.len()],
        record: &record,
    };
    relabel::write(to, from, &labels, &SiteFromFile::default(), Records::All)?;
    Ok(())
}
