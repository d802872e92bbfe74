//! Prints simulated pings over a flat bed as CSV, for `tools/oracle/mbes_statistics.py`.

use geom::SeedTree;
use synth::sensor::Mbes;

fn main() {
    let sounder = Mbes { half_swath_deg: 61.5, ..Default::default() };
    println!("ping,beam,angle_rad,range_m");
    for (ping, beams) in sounder.flat_bed_pings(10.5, 923, SeedTree::new(1)).iter().enumerate() {
        for (beam, (angle, range)) in beams.iter().enumerate() {
            println!("{ping},{beam},{angle},{range}");
        }
    }
}
