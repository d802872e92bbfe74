//! Damage to the bytes of a file; the same for the same seed.

use geom::SeedTree;

/// Values that break arithmetic.
const EXTREMES: [u64; 8] =
    [0, 1, u64::MAX, 1 << 31, (1 << 31) - 1, 0xffff_ffff, 1 << 62, 0x7ff8_0000_0000_0000];

/// One to three kinds of damage.
pub fn damaged(seed: &[u8], tree: SeedTree) -> Vec<u8> {
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
