//! Columns between Python's bytes and Rust's vectors. Little-endian, packed; numpy looks at the bytes where they lie.

use crate::errors::bad_input;
use geom::Pose;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use scene::SiteFrame;

/// A number of fixed width.
pub trait Number: Copy {
    /// Its bytes.
    type Bytes: AsRef<[u8]> + for<'a> TryFrom<&'a [u8]>;
    /// To bytes.
    fn to_bytes(self) -> Self::Bytes;
    /// From bytes.
    fn of_bytes(bytes: Self::Bytes) -> Self;
}

macro_rules! number {
    ($($t:ty),+) => {$(
        impl Number for $t {
            type Bytes = [u8; size_of::<$t>()];
            fn to_bytes(self) -> Self::Bytes {
                self.to_le_bytes()
            }
            fn of_bytes(bytes: Self::Bytes) -> Self {
                Self::from_le_bytes(bytes)
            }
        }
    )+};
}

number!(u8, u16, u32, f32, f64);

/// Writes numbers straight into a bytes object. `count`: how many there are.
pub fn bytes<'py, N: Number>(
    py: Python<'py>,
    count: usize,
    numbers: impl Iterator<Item = N>,
) -> PyResult<Bound<'py, PyBytes>> {
    PyBytes::new_with(py, count * size_of::<N::Bytes>(), |buffer| {
        for (place, number) in buffer.chunks_exact_mut(size_of::<N::Bytes>()).zip(numbers) {
            place.copy_from_slice(number.to_bytes().as_ref());
        }
        Ok(())
    })
}

/// The numbers of a column.
pub fn numbers<N: Number>(bytes: &[u8]) -> impl Iterator<Item = N> {
    bytes.chunks_exact(size_of::<N::Bytes>()).map(|place| match place.try_into() {
        Ok(bytes) => N::of_bytes(bytes),
        Err(_) => unreachable!("a chunk has this many bytes"),
    })
}

/// Rows of W numbers. Error: the column does not end with a whole row.
pub fn rows<N: Number + Default, const W: usize>(
    name: &str,
    bytes: &[u8],
) -> PyResult<Vec<[N; W]>> {
    let row = W * size_of::<N::Bytes>();
    if !bytes.len().is_multiple_of(row) {
        return Err(bad_input(format!("{name}: {} bytes are no rows of {row}", bytes.len())));
    }
    let one = |place: &[u8]| {
        let mut row = [N::default(); W];
        row.iter_mut().zip(numbers(place)).for_each(|(to, from)| *to = from);
        row
    };
    Ok(bytes.chunks_exact(row).map(one).collect())
}

/// A pose as the 16 numbers of a matrix, row by row, in site coordinates.
pub fn matrix(pose: &Pose, frame: &SiteFrame) -> [f64; 16] {
    let r = geom::DMat3::from_quat(pose.rotation.as_dquat().normalize());
    let t = frame.site_from_local(pose.translation);
    let row = |i: usize, t: f64| [r.x_axis[i], r.y_axis[i], r.z_axis[i], t];
    let rows = [row(0, t.x), row(1, t.y), row(2, t.z), [0.0, 0.0, 0.0, 1.0]];
    let mut all = [0.0; 16];
    all.iter_mut().zip(rows.iter().flatten()).for_each(|(to, from)| *to = *from);
    all
}

/// The quaternion x, y, z, w of a pose.
pub fn quaternion(pose: &Pose) -> [f64; 4] {
    let q = pose.rotation;
    [q.x, q.y, q.z, q.w].map(f64::from)
}
