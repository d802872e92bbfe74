//! Named child seeds: every random choice has its own stream, so that order and threads never matter.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// A node of the seed tree. The same path from the same root gives the same stream on every machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeedTree {
    state: u64,
}

impl SeedTree {
    /// The root for a user's seed.
    pub fn new(seed: u64) -> Self {
        Self { state: mix(seed ^ 0x7473_756d_7520_3031) }
    }

    /// The child `name`/`index`, for example `("synth", scene)`.
    pub fn child(&self, name: &str, index: u64) -> Self {
        let named = name.bytes().fold(self.state, |s, b| mix(s ^ u64::from(b)));
        Self { state: mix(named ^ mix(index.wrapping_add(0x9e37_79b9_7f4a_7c15))) }
    }

    /// The generator of this node.
    pub fn rng(&self) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(self.state)
    }

    /// The node as one number, for files and messages.
    pub fn value(&self) -> u64 {
        self.state
    }
}

/// The finaliser of SplitMix64: every input bit reaches every output bit.
fn mix(z: u64) -> u64 {
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn children_differ_and_repeat() {
        let root = SeedTree::new(7);
        assert_eq!(root.child("a", 1), root.child("a", 1));
        assert_ne!(root.child("a", 1), root.child("a", 2));
        assert_ne!(root.child("a", 1), root.child("b", 1));
        assert_ne!(root.child("a", 1), SeedTree::new(8).child("a", 1));
        let draw = |s: SeedTree| s.rng().random::<u64>();
        assert_eq!(draw(root.child("x", 0)), draw(root.child("x", 0)));
    }
}
