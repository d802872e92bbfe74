//! Damages every seed file in many ways; the same ways on every run.

use crate::damage::damaged;
use crate::{read_within_limits, seeds};
use geom::SeedTree;

/// Mutants of each file; `TSUMU_MUTANTS=30000` for an hour's work.
fn mutants_each() -> u64 {
    std::env::var("TSUMU_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(800)
}

/// How many were tried and how many refused.
pub fn all_are_harmless() -> (u64, u64) {
    let (mut tried, mut refused) = (0, 0);
    for (number, (kind, seed)) in seeds::all().into_iter().enumerate() {
        read_within_limits(kind, &seed)
            .unwrap_or_else(|e| panic!("the undamaged {kind} file is refused: {e}"));
        if kind == "e57" {
            let mut mended = seed.clone();
            mend_checksums(&mut mended);
            assert!(mended == seed, "mending must leave a sound file alone");
        }
        let tree = SeedTree::new(7).child(kind, number as u64);
        for i in 0..mutants_each() {
            let mut mutant = damaged(&seed, tree.child("mutant", i));
            if kind == "e57" && i % 4 != 0 {
                mend_checksums(&mut mutant); // else nothing but the check is tested
            }
            tried += 1;
            if let Err(error) = read_within_limits(kind, &mutant) {
                refused += 1;
                let line = error.to_string();
                assert!(
                    line.contains("hostile.") && !line.contains('\n') && line.len() < 2000,
                    "{line}"
                );
            }
        }
    }
    (tried, refused)
}

/// E57 ends each page of 1024 bytes with its CRC-32C, big-endian.
fn mend_checksums(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(1024) {
        let mut crc = u32::MAX;
        for &byte in &page[..1020] {
            crc ^= u32::from(byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { (crc >> 1) ^ 0x82f6_3b78 } else { crc >> 1 };
            }
        }
        page[1020..].copy_from_slice(&(!crc).to_be_bytes());
    }
}
