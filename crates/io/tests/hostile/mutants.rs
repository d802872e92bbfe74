//! Damages every seed file in many ways; the same ways on every run.

use crate::{read_within_limits, seeds};
use geom::SeedTree;

const MUTANTS_EACH: u64 = 800;
/// Values that break arithmetic.
const EXTREMES: [u64; 8] =
    [0, 1, u64::MAX, 1 << 31, (1 << 31) - 1, 0xffff_ffff, 1 << 62, 0x7ff8_0000_0000_0000];

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
        for i in 0..MUTANTS_EACH {
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

/// One to three kinds of damage.
fn damaged(seed: &[u8], tree: SeedTree) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    let draw = |name: &str, step: u64, below: usize| {
        (tree.child(name, step).value() % below.max(1) as u64) as usize
    };
    for step in 0..1 + draw("steps", 0, 3) as u64 {
        // Half of all damage goes where the headers are.
        let reach = if draw("early", step, 2) == 0 { bytes.len().min(500) } else { bytes.len() };
        let at = draw("at", step, reach);
        match draw("kind", step, 7) {
            0 => bytes.truncate(at),
            1 => flip(&mut bytes, at, draw("bit", step, 8)),
            2 => {
                let value = EXTREMES[draw("value", step, EXTREMES.len())].to_le_bytes();
                let n = [1, 2, 4, 8][draw("width", step, 4)].min(bytes.len().saturating_sub(at));
                bytes[at..at + n].copy_from_slice(&value[..n]);
            }
            3 => {
                let end = (at + draw("length", step, 64)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 => {
                let end = (at + draw("length", step, 64)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = draw("to", step, bytes.len());
                bytes.splice(to..to, copy);
            }
            5 => {
                // Numbers in texts grow.
                let text: &[u8] =
                    [&b"99999999999"[..], b"-1", b"nan", b"1e308", b"\"", b"\n", b","]
                        [draw("text", step, 7)];
                bytes.splice(at..at, text.iter().copied());
            }
            _ => {
                let end = (at + draw("length", step, 200)).min(bytes.len());
                bytes[at..end]
                    .iter_mut()
                    .enumerate()
                    .for_each(|(i, b)| *b = tree.child("noise", i as u64).value() as u8);
            }
        }
    }
    bytes
}

fn flip(bytes: &mut [u8], at: usize, bit: usize) {
    if let Some(b) = bytes.get_mut(at) {
        *b ^= 1 << bit;
    }
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
