//! A bound on memory that holds where the estimate was wrong: the program ends with a line before the system ends it without.

use std::time::Duration;
use tsumu::MemoryLimit;

/// How often memory is looked at: at the rate at which a program can take memory, some hundred megabytes.
const EVERY: Duration = Duration::from_millis(50);

/// Watches for as long as the program runs, where the system tells how much memory a program has.
pub(crate) fn over(limit: MemoryLimit) {
    if resident_bytes().is_none() {
        return;
    }
    let watch = move || {
        loop {
            std::thread::sleep(EVERY);
            let (Some(limit), Some(now)) = (limit.bytes(), limit.bytes().and(resident_bytes()))
            else {
                continue;
            };
            if now > limit {
                crate::terminal::to_stderr(&format!(
                    "tsumu: stopped: {:.2} GB of memory are in use, more than the {:.2} GB it may take (--memory, or `memory` in site.toml); finished parts are kept: allow more and give the same command again, or give [area] for a part of the site",
                    now as f64 / 1e9,
                    limit as f64 / 1e9
                ));
                std::process::exit(1);
            }
        }
    };
    // A machine without room for a small thread has no room for the work either; that says so itself.
    let _ = std::thread::Builder::new().name("memory".into()).stack_size(64 << 10).spawn(watch);
}

/// Memory of this program as Linux tells it; other systems do not through a file.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_that_is_taken_is_seen() {
        let before = resident_bytes().unwrap();
        let block = vec![1_u8; 64 << 20];
        assert!(std::hint::black_box(&block).iter().step_by(4096).all(|b| *b == 1));
        assert!(resident_bytes().unwrap() > before + (48 << 20));
    }
}
