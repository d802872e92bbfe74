//! A text file that holds its own hash: BLAKE3 of itself with zeros in the hash's place, so that a change of any byte tells.

const DIGITS: usize = 64;
const KEY: &str = "\"own_blake3\": \"";

/// What stands in the place until the text is sealed.
pub(crate) fn zeros() -> String {
    "0".repeat(DIGITS)
}

/// Puts the hash in its place; the first `"own_blake3"` of the text holds [`zeros`].
pub(crate) fn seal(mut text: String) -> String {
    if let Some(place) = place(text.as_bytes()) {
        let own = blake3::hash(text.as_bytes()).to_hex();
        text.replace_range(place, own.as_str());
    }
    text
}

/// Whether every byte is as it was sealed; `None` for a text without a hash of its own.
pub(crate) fn is_whole(bytes: &[u8]) -> Option<bool> {
    let place = place(bytes)?;
    let mut zeroed = bytes.to_vec();
    zeroed[place.clone()].fill(b'0');
    Some(blake3::hash(&zeroed).to_hex().as_bytes() == &bytes[place])
}

fn place(bytes: &[u8]) -> Option<std::ops::Range<usize>> {
    let key = bytes.windows(KEY.len()).position(|w| w == KEY.as_bytes())?;
    let first = key + KEY.len();
    (first + DIGITS <= bytes.len()).then_some(first..first + DIGITS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_change_of_a_byte_tells(at in 0_usize..200, with in 1_u8..=255) {
            let text = seal(format!("{{\n  \"a\": 1,\n  {KEY}{}\",\n  \"b\": [2, 3]\n}}\n", zeros()));
            prop_assert_eq!(is_whole(text.as_bytes()), Some(true));
            let mut bytes = text.into_bytes();
            let at = at % bytes.len();
            bytes[at] ^= with;
            // A key that is damaged leaves no hash, which its reader asks for.
            prop_assert_ne!(is_whole(&bytes), Some(true));
        }
    }
}
