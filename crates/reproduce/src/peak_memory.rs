//! The most memory a piece of work took, as the system counts it.
//!
//! Linux alone lets a process begin its count anew; elsewhere nothing is stated. Pages that the allocator held back from earlier
//! work count for nobody: `MIMALLOC_PURGE_DELAY=0` in the environment gives them back at once, at some cost in time.

use std::fs;

/// Does the work; with it the bytes it took beyond what the process held before, where the system tells.
pub fn with_peak<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    // 5: the high-water mark falls to what is held now.
    let counted = fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = held("VmRSS:");
    let made = work();
    let peak = held("VmHWM:").filter(|_| counted);
    (made, peak.zip(before).map(|(peak, before)| peak.saturating_sub(before)))
}

/// A line of the process' status, bytes.
fn held(name: &str) -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix(name))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_held_at_the_same_time_is_counted() {
        let (sum, peak) = with_peak(|| {
            let held: Vec<u8> = (0..64_usize << 20).map(|i| (i % 251) as u8).collect();
            held.iter().map(|&b| u64::from(b)).sum::<u64>()
        });
        assert!(sum > 0);
        if let Some(peak) = peak {
            assert!(peak > 32 << 20, "{peak}");
        }
    }
}
