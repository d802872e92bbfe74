//! What the sensors saw first along their rays: a depth image per sensor position or far direction.
//!
//! A place in front of everything measured around its ray is *empty*: the sensor looked through it. A place behind
//! is *hidden*. Judged on three by three pixels so that noise and the raster do not matter.

use geom::{Bounds, Mat3, Vec3};

/// Depth images of at most a handful of sensor positions.
pub struct Sight {
    views: Vec<View>,
}

/// What a sensor can say of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Something was measured here.
    Here,
    /// The sensor looked through this place and measured something behind it.
    Through,
    /// Something was measured in front.
    Hidden,
    /// Nothing was measured along this ray.
    Unknown,
}

struct View {
    /// Rows: right, forward-up and viewing direction.
    view_from_site: Mat3,
    /// Sensor position; `None` for parallel rays from afar.
    position: Option<Vec3>,
    low: [f32; 2],
    pixel: f32,
    count: [usize; 2],
    /// Nearest depth of each pixel, infinite where empty.
    depth: Vec<f32>,
}

/// Sensor positions looked from; more add time, hardly knowledge.
const MOST_VIEWS: usize = 5;
/// Pixels of one view at most.
const MOST_PIXELS: usize = 4_000_000;

/// Surface that looks at a sensor by less than this cosine may be seen or not.
pub const LEAST_COSINE: f32 = 0.25;

impl Sight {
    /// Depth images of the points from the positions.
    pub fn new(points: &[Vec3], sensors: &[Vec3], spacing_m: f32) -> Self {
        let bounds = Bounds::of(points.iter().copied());
        if bounds.is_empty() {
            return Self { views: Vec::new() };
        }
        let centre = bounds.centre();
        let view = |s: Vec3| {
            let away = (centre - s).try_normalize().unwrap_or(Vec3::NEG_Z);
            View::new(points, Some(s), away, (centre - s).length().max(1e-6), spacing_m)
        };
        Self { views: spread(sensors, centre).into_iter().map(view).collect() }
    }

    /// Depth images of the points from far away, one a direction.
    pub fn from_afar(points: &[Vec3], toward: &[Vec3], spacing_m: f32) -> Self {
        let view = |&toward: &Vec3| View::new(points, None, -toward, 1.0, spacing_m);
        Self {
            views: if points.is_empty() { Vec::new() } else { toward.iter().map(view).collect() },
        }
    }

    /// The verdict of all views on a piece of surface at `p` with outward `normal`; `None` when it faces none.
    pub fn of_surface(&self, p: Vec3, normal: Vec3, margin_m: f32) -> Option<Seen> {
        self.of_surface_facing(p, normal, margin_m, LEAST_COSINE)
    }

    /// The same, of views that the surface is turned to by more than this cosine.
    pub fn of_surface_facing(
        &self,
        p: Vec3,
        normal: Vec3,
        margin_m: f32,
        least_cosine: f32,
    ) -> Option<Seen> {
        let (mut here, mut through, mut hidden, mut unknown) = (0, 0, 0, 0);
        for view in &self.views {
            if normal.dot(view.toward(p)) < least_cosine {
                continue;
            }
            match view.seen(p, margin_m) {
                Seen::Here => here += 1,
                Seen::Through => through += 1,
                Seen::Hidden => hidden += 1,
                Seen::Unknown => unknown += 1,
            }
        }
        // One sensor that looks through against others that are blocked is enough; against one that sees it, not.
        if through > here {
            Some(Seen::Through)
        } else if here > 0 {
            Some(Seen::Here)
        } else if unknown > 0 && hidden == 0 {
            Some(Seen::Unknown)
        } else if hidden > 0 {
            Some(Seen::Hidden)
        } else {
            None
        }
    }
    /// Whether a sensor looked through a place where there should be something solid.
    pub fn looked_through(&self, p: Vec3, margin_m: f32) -> bool {
        self.views.iter().any(|view| view.seen(p, margin_m) == Seen::Through)
    }
}

/// The position nearest to the cloud's centre and those farthest from each other.
fn spread(sensors: &[Vec3], centre: Vec3) -> Vec<Vec3> {
    let nearest = |a: &&Vec3, b: &&Vec3| {
        (**a - centre).length_squared().total_cmp(&(**b - centre).length_squared())
    };
    let Some(&first) = sensors.iter().min_by(nearest) else { return Vec::new() };
    let mut picked = vec![first];
    let mut far: Vec<f32> = sensors.iter().map(|s| (*s - first).length_squared()).collect();
    while picked.len() < MOST_VIEWS.min(sensors.len()) {
        let (i, &d) =
            far.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("there is a sensor");
        if d <= 0.0 {
            break;
        }
        picked.push(sensors[i]);
        for (f, s) in far.iter_mut().zip(sensors) {
            *f = f.min((*s - sensors[i]).length_squared());
        }
    }
    picked
}

impl View {
    fn new(
        points: &[Vec3],
        position: Option<Vec3>,
        forward: Vec3,
        range_m: f32,
        spacing_m: f32,
    ) -> Self {
        let right = forward.any_orthonormal_vector();
        let view_from_site = Mat3::from_cols(right, forward.cross(right), forward).transpose();
        let mut view = Self {
            view_from_site,
            position,
            low: [0.0; 2],
            pixel: (1.6 * spacing_m / range_m).max(f32::MIN_POSITIVE),
            count: [0; 2],
            depth: Vec::new(),
        };
        let projected: Vec<_> = points.iter().filter_map(|&p| view.project(p)).collect();
        let fold = |f: fn(f32, f32) -> f32, start: f32, axis: usize| {
            projected.iter().map(|(uv, _)| uv[axis]).fold(start, f)
        };
        if projected.is_empty() {
            return view;
        }
        view.low = [fold(f32::min, f32::INFINITY, 0), fold(f32::min, f32::INFINITY, 1)];
        let high = [fold(f32::max, f32::NEG_INFINITY, 0), fold(f32::max, f32::NEG_INFINITY, 1)];
        let size = [high[0] - view.low[0], high[1] - view.low[1]];
        let smallest =
            (size[0] * size[1] / MOST_PIXELS as f32).sqrt().max(size[0].max(size[1]) / 1e5);
        view.pixel = view.pixel.max(smallest);
        view.count = size.map(|s| (s / view.pixel) as usize + 1);
        view.depth = vec![f32::INFINITY; view.count[0] * view.count[1]];
        for (uv, depth) in projected {
            let i = view.pixel_of(uv).expect("the raster was made around these points");
            let at = i[1] * view.count[0] + i[0];
            view.depth[at] = view.depth[at].min(depth);
        }
        view
    }

    /// Image coordinates and depth; `None` behind the sensor or at a grazing angle.
    fn project(&self, p: Vec3) -> Option<([f32; 2], f32)> {
        match self.position {
            None => {
                let q = self.view_from_site * p;
                Some(([q.x, q.y], q.z))
            }
            Some(s) => {
                let q = self.view_from_site * (p - s);
                let range = q.length();
                (q.z > 0.1 * range).then(|| ([q.x / q.z, q.y / q.z], range))
            }
        }
    }

    fn pixel_of(&self, uv: [f32; 2]) -> Option<[usize; 2]> {
        let at = [0, 1].map(|k| (uv[k] - self.low[k]) / self.pixel);
        let ok = at[0] >= 0.0
            && at[1] >= 0.0
            && (at[0] as usize) < self.count[0]
            && (at[1] as usize) < self.count[1];
        ok.then(|| at.map(|v| v as usize))
    }

    fn toward(&self, p: Vec3) -> Vec3 {
        self.position.map_or(-self.view_from_site.row(2), |s| (s - p).normalize_or_zero())
    }

    fn seen(&self, p: Vec3, margin_m: f32) -> Seen {
        let Some((uv, depth)) = self.project(p) else { return Seen::Unknown };
        let Some([x, y]) = self.pixel_of(uv) else { return Seen::Unknown };
        let (mut near, mut far, mut filled) = (f32::INFINITY, f32::NEG_INFINITY, 0);
        for j in y.saturating_sub(1)..(y + 2).min(self.count[1]) {
            for &d in &self.depth[j * self.count[0] + x.saturating_sub(1)
                ..j * self.count[0] + (x + 2).min(self.count[0])]
            {
                if d.is_finite() {
                    near = near.min(d);
                    far = far.max(d);
                    filled += 1;
                }
            }
        }
        if filled < 3 {
            Seen::Unknown
        } else if depth < near - margin_m {
            Seen::Through
        } else if depth > far + margin_m {
            Seen::Hidden
        } else {
            Seen::Here
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floor() -> Vec<Vec3> {
        (0..900).map(|i| Vec3::new((i % 30) as f32 * 0.1, (i / 30) as f32 * 0.1, 0.0)).collect()
    }

    #[test]
    fn empty_above_hidden_below_here_on_the_floor() {
        let [above, aside] = [Vec3::new(1.5, 1.5, 10.0), Vec3::new(9.0, 1.0, 8.0)];
        let oblique = Vec3::new(0.6, 0.0, 0.8);
        for sight in [
            Sight::from_afar(&floor(), &[Vec3::Z], 0.1),
            Sight::from_afar(&floor(), &[Vec3::Z, oblique], 0.1),
            Sight::new(&floor(), &[above], 0.1),
            Sight::new(&floor(), &[above, aside], 0.1),
        ] {
            let at = |z: f32| sight.of_surface(Vec3::new(1.5, 1.4, z), Vec3::Z, 0.05);
            assert_eq!(at(0.5), Some(Seen::Through));
            assert_eq!(at(0.0), Some(Seen::Here));
            assert_eq!(at(-0.5), Some(Seen::Hidden));
            assert_eq!(sight.of_surface(Vec3::new(1.5, 1.4, 0.5), Vec3::NEG_Z, 0.05), None);
            assert_eq!(
                sight.of_surface(Vec3::new(8.0, 1.4, 0.0), Vec3::Z, 0.05),
                Some(Seen::Unknown)
            );
        }
    }
}
