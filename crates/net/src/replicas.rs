//! Data-parallel gradients on a CPU: the library's element-wise operations are serial, so the second core earns its
//! keep as a second replica.

use burn::module::Module;
use burn::optim::{GradientsAccumulator, GradientsParams};

/// One-thread pools, one a replica.
pub struct Replicas {
    pools: Vec<rayon::ThreadPool>,
}

impl Replicas {
    /// `count` replicas. Errors when the system gives no thread.
    pub fn new(count: usize) -> Result<Self, String> {
        let pool = |_| rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| e.to_string());
        Ok(Self { pools: (0..count.max(1)).map(pool).collect::<Result<_, _>>()? })
    }

    /// Number of replicas.
    pub fn len(&self) -> usize {
        self.pools.len()
    }

    /// Always false.
    pub fn is_empty(&self) -> bool {
        self.pools.is_empty()
    }

    /// Runs `work` once a replica at the same time, each on one thread; results in the order of the replicas.
    pub fn run<T: Send>(&self, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let work = &work;
        std::thread::scope(|scope| {
            let threads: Vec<_> =
                self.pools.iter().enumerate().map(|(i, pool)| scope.spawn(move || pool.install(|| work(i)))).collect();
            threads.into_iter().map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
        })
    }
}

/// The sum of the replicas' gradients, in their order.
pub fn sum_gradients<M: Module>(module: &M, parts: Vec<GradientsParams>) -> GradientsParams {
    let mut sum = GradientsAccumulator::new();
    for part in parts {
        sum.accumulate(module, part);
    }
    sum.grads()
}
