//! Whether the place that a file gives for its sensor can be one: near its own points. Programs use the same field for a
//! shift that keeps the numbers small.

use crate::RawCloud;
use geom::DVec3;

/// A sensor stands within so many extents of its own points.
const REACH: f64 = 10.0;
/// From here on coordinates are those of a map, not of a room or a yard.
const MAP: f64 = 1000.0;

/// One scan's stated place, and the box of the points seen from there.
#[derive(Clone, Debug)]
pub struct Station {
    place: Option<DVec3>,
    turned: bool,
    low: DVec3,
    high: DVec3,
}

impl Station {
    /// `turned`: the pose also turns the points, which no mere shift does.
    pub fn new(place: Option<DVec3>, turned: bool) -> Self {
        Self { place, turned, low: DVec3::INFINITY, high: DVec3::NEG_INFINITY }
    }

    /// Another point of this scan.
    #[inline]
    pub fn see(&mut self, p: DVec3) {
        self.low = self.low.min(p);
        self.high = self.high.max(p);
    }

    /// Adds the place to the cloud's sensors, or a note of why it is none.
    pub fn finish(self, cloud: &mut RawCloud) {
        let Some(place) = self.place else { return };
        match self.objection(place) {
            None => cloud.sensor_positions.push(place),
            Some(why) => {
                let DVec3 { x, y, z } = place;
                cloud.notes.push(format!(
                    "the place ({x}, {y}, {z}) is taken for a shift, not for the sensor: {why}"
                ));
            }
        }
    }

    fn objection(&self, place: DVec3) -> Option<String> {
        if self.low.x > self.high.x {
            return None; // no points, nothing to compare with
        }
        let extent = (self.high - self.low).max_element();
        let away = (self.low - place).max(place - self.high).max(DVec3::ZERO).length();
        if away > REACH * extent {
            return Some(format!("it is {away:.0} m away from points that span {extent:.1} m"));
        }
        let whole = place.to_array().iter().all(|v| v.fract() == 0.0);
        let on_a_map = place.truncate().abs().max_element() >= MAP;
        (whole && on_a_map && !self.turned && away > 0.0)
            .then(|| "it is all whole numbers and turns nothing".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(place: DVec3, turned: bool, size: f64) -> bool {
        let mut station = Station::new(Some(place), turned);
        let at = DVec3::new(41_250.0, -98_760.0, 2.0);
        station.see(at);
        station.see(at + size);
        let mut cloud = RawCloud::default();
        station.finish(&mut cloud);
        assert_eq!(cloud.sensor_positions.len() + cloud.notes.len(), 1);
        cloud.notes.is_empty()
    }

    #[test]
    fn a_shift_is_no_sensor() {
        let shift = DVec3::new(41_200.0, -98_700.0, 0.0);
        assert!(!kept(shift, false, 5.0));
        assert!(!kept(shift, false, 50.0));
        assert!(!kept(DVec3::ZERO, true, 50.0));
        assert!(kept(DVec3::new(41_247.3, -98_790.12, 4.7), false, 5.0));
        assert!(kept(DVec3::new(41_230.0, -98_760.0, 4.0), true, 5.0));
    }
}
