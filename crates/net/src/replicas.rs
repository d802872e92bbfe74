//! Data-parallel gradients on a CPU: the library's element-wise operations are serial, so the second core earns its
//! keep as a second replica. The same pools run many independent jobs, one thread each.

use burn::module::Module;
use burn::optim::{GradientsAccumulator, GradientsParams};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// One-thread pools, one a replica.
pub struct Replicas {
    pools: Vec<rayon::ThreadPool>,
}

impl Replicas {
    /// `count` replicas. Errors when the system gives no thread.
    pub fn new(count: usize) -> Result<Self, String> {
        let pool =
            |_| rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| e.to_string());
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
            let threads: Vec<_> = self
                .pools
                .iter()
                .enumerate()
                .map(|(i, pool)| scope.spawn(move || pool.install(|| work(i))))
                .collect();
            threads
                .into_iter()
                .map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
                .collect()
        })
    }
}

/// Runs `work(0)` to `work(jobs - 1)`, each on one thread, as many at a time as the current rayon pool has threads.
/// `done` hears the results on the calling thread, in no fixed order, and says whether to go on.
pub fn each_on_one_thread<T: Send>(
    jobs: usize,
    work: impl Fn(usize) -> T + Sync,
    mut done: impl FnMut(usize, T) -> bool,
) -> Result<(), String> {
    let threads = rayon::current_num_threads().min(jobs);
    if threads < 2 {
        for job in 0..jobs {
            if !done(job, work(job)) {
                break;
            }
        }
        return Ok(());
    }
    let replicas = Replicas::new(threads)?;
    let next = AtomicUsize::new(0);
    // Room for one result a thread: results wait for the caller, not in memory.
    let (send, results) = mpsc::sync_channel(threads);
    let (work, next) = (&work, &next);
    std::thread::scope(|scope| {
        for pool in &replicas.pools {
            let send = send.clone();
            scope.spawn(move || {
                loop {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    // A caller that has heard enough hangs up.
                    if job >= jobs || send.send((job, pool.install(|| work(job)))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(send);
        let mut left = jobs;
        while left > 0
            && let Ok((job, result)) = results.recv()
        {
            left -= 1;
            if !done(job, result) {
                break;
            }
        }
        drop(results);
    });
    Ok(())
}

/// The sum of the replicas' gradients, in their order.
pub fn sum_gradients<M: Module>(module: &M, parts: Vec<GradientsParams>) -> GradientsParams {
    let mut sum = GradientsAccumulator::new();
    for part in parts {
        sum.accumulate(module, part);
    }
    sum.grads()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_is_done_once_and_a_caller_may_stop() {
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let run = |jobs: usize, most: usize| {
                let mut heard = Vec::new();
                let work = |job: usize| (job * job, rayon::current_num_threads());
                let note = |job: usize, (square, width): (usize, usize)| {
                    assert!(square == job * job && width == 1);
                    heard.push(job);
                    heard.len() < most
                };
                pool.install(|| each_on_one_thread(jobs, work, note)).unwrap();
                heard.sort_unstable();
                heard
            };
            assert_eq!(run(20, 99), (0..20).collect::<Vec<_>>());
            assert_eq!(run(20, 4).len(), 4);
            assert!(run(0, 99).is_empty());
        }
    }
}
