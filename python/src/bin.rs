//! A bin that stays: a thread of its own holds weights and types, and looks at one cloud after the other.

use crate::catalog::Catalog;
use crate::columns::{bytes, matrix, quaternion};
use crate::errors::{bad_input, raised};
use crate::site::{Columns, Given};
use crate::work::{Asked, STACK_BYTES, Teller, fault, listen, warn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::Builder;
use tsumu::{Arrays, BinLook, BinOptions, Cancel, Job, RecogniseOptions, Result};

/// One cloud to look at.
struct Order {
    cloud: Arrays,
    teller: Teller,
    cancel: Cancel,
    back: Sender<(Result<BinLook>, Vec<String>)>,
}

/// Weights and types that stay from one cloud to the next.
#[pyclass(frozen)]
pub struct Bin {
    orders: Mutex<Option<Sender<Order>>>,
    catalog: std::sync::Arc<scene::Catalog>,
}

#[pymethods]
impl Bin {
    /// Makes everything ready.
    #[staticmethod]
    fn start(
        py: Python<'_>,
        catalog: &Catalog,
        given: Given,
        weights: Option<PathBuf>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let settings = given.settings()?;
        let options = BinOptions {
            recognise: RecogniseOptions { weights, ..RecogniseOptions::default() },
            settings,
        };
        let (orders, taken) = channel();
        let (tell_ready, ready) = channel();
        let kept = catalog.0.clone();
        let own = kept.clone();
        let body = move || stay(&own, &options, threads, &tell_ready, &taken);
        let started = Builder::new().name("tsumu bin".into()).stack_size(STACK_BYTES).spawn(body);
        started.map_err(|e| raised(&tsumu::Error::failed(e)))?;
        let ready = py.detach(move || ready.recv());
        ready.map_err(|_| fault())?.map_err(|e| raised(&e))?;
        Ok(Self { orders: Mutex::new(Some(orders)), catalog: kept })
    }

    /// Looks at a cloud: columns of the parts in the order in which to take them.
    fn look<'py>(
        &self,
        py: Python<'py>,
        columns: Columns,
        asked: Asked,
    ) -> PyResult<Bound<'py, PyDict>> {
        let cloud = columns.arrays(py)?;
        drop(columns);
        let (tell, hear) = channel();
        let (back, answer) = channel();
        let cancel = Cancel::default();
        let order = Order { cloud, teller: Teller::new(tell), cancel: cancel.clone(), back };
        let orders = self.orders.lock().expect("no thread panics with this lock").clone();
        let orders = orders.ok_or_else(|| bad_input("the bin is closed"))?;
        orders.send(order).map_err(|_| fault())?;
        let interrupted = listen(py, hear, asked.progress(), &cancel);
        let (looked, warnings) = py.detach(move || answer.recv()).map_err(|_| fault())?;
        interrupted?;
        let look = looked.map_err(|e| raised(&e))?;
        warn(py, warnings)?;
        self.columns(py, &look)
    }

    /// Lets weights and types go.
    fn close(&self) {
        self.orders.lock().expect("no thread panics with this lock").take();
    }
}

impl Bin {
    fn columns<'py>(&self, py: Python<'py>, look: &BinLook) -> PyResult<Bound<'py, PyDict>> {
        let (all, n, frame) = (&look.grasps, look.grasps.len(), &look.frame);
        let columns = PyDict::new(py);
        columns.set_item("id", bytes(py, n, all.iter().map(|g| g.block.0))?)?;
        columns.set_item("type", bytes(py, n, all.iter().map(|g| g.model.0))?)?;
        let judged = all.iter().map(|g| u8::from(g.fit.type_judged));
        columns.set_item("type_judged", bytes(py, n, judged)?)?;
        let poses = all.iter().flat_map(|g| matrix(&g.fit.site_from_block, frame));
        columns.set_item("pose", bytes(py, 16 * n, poses)?)?;
        let turns = all.iter().flat_map(|g| quaternion(&g.fit.site_from_block));
        columns.set_item("quaternion", bytes(py, 4 * n, turns)?)?;
        let centres = all.iter().flat_map(|g| {
            frame.site_from_local(g.fit.centre(self.catalog.get(g.model))).to_array()
        });
        columns.set_item("centre", bytes(py, 3 * n, centres)?)?;
        let known = |v: Option<f32>| v.unwrap_or(f32::NAN);
        let confidence = all.iter().map(|g| known(g.fit.confidence));
        columns.set_item("confidence", bytes(py, n, confidence)?)?;
        let occlusion = all.iter().map(|g| known(g.fit.occlusion));
        columns.set_item("occlusion", bytes(py, n, occlusion)?)?;
        columns.set_item("free", bytes(py, n, all.iter().map(|g| g.free))?)?;
        let stated = look.blocks.iter().filter(|b| b.is_stated()).count();
        columns.set_item("not_judged", look.blocks.len() - stated)?;
        Ok(columns)
    }
}

/// The life of the thread: ready, then one order after the other until nobody can give any.
fn stay(
    catalog: &scene::Catalog,
    options: &BinOptions,
    threads: Option<usize>,
    ready: &Sender<Result<()>>,
    orders: &Receiver<Order>,
) {
    let start = || -> Result<(Job<'static>, tsumu::Bin<'_>)> {
        let job = pooled(Job::silent(), threads)?;
        let bin = tsumu::Bin::new(catalog, options, &job)?;
        Ok((job, bin))
    };
    let (pool, bin) = match start() {
        Ok(both) => both,
        Err(error) => {
            // Nobody listens any more: then there is nobody to tell.
            let _ = ready.send(Err(error));
            return;
        }
    };
    if ready.send(Ok(())).is_err() {
        return;
    }
    for Order { cloud, teller, cancel, back } in orders {
        let job = Job::new(&teller).cancelled_by(cancel);
        let looked = pool.install(|| bin.look(cloud, &job));
        let _ = back.send((looked, job.warnings()));
    }
}

fn pooled(job: Job<'static>, threads: Option<usize>) -> Result<Job<'static>> {
    match threads {
        Some(n) => job.on_threads(n),
        None => Ok(job),
    }
}
