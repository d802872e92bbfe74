//! Names of sites and blocks: words that go into every table, drawing and page.
//!
//! One rule for all of them, checked where a name enters, so that no writer downstream meets a name that its format
//! cannot hold or that a reader would show otherwise than it is.

/// Longest name, characters: what a drawing's table and a page still show whole.
pub const LONGEST_NAME: usize = 64;

/// Why a name cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// Nothing to read.
    #[error("{what} `{name}` is blank; give a name with a letter or a digit")]
    Blank {
        /// What is named, e.g. `the name of block 2`.
        what: String,
        /// The name as given.
        name: String,
    },
    /// Too long.
    #[error("{what} `{start}…` has {length} characters; at most {LONGEST_NAME} fit")]
    TooLong {
        /// What is named.
        what: String,
        /// Its first characters.
        start: String,
        /// Its length, characters.
        length: usize,
    },
    /// A character that cannot be seen, or turns the text around.
    #[error(
        "{what} `{shown}` holds the invisible character U+{code:04X} at place {place}; type the name anew"
    )]
    Invisible {
        /// What is named.
        what: String,
        /// The name without such characters.
        shown: String,
        /// Code point.
        code: u32,
        /// Place in the name, characters from 1.
        place: usize,
    },
}

/// Checks one name; `what` says in the message which one it is.
pub fn check_name(what: impl Into<String>, name: &str) -> Result<(), NameError> {
    let what = what.into();
    if let Some((place, c)) = name.chars().enumerate().find(|&(_, c)| invisible(c)) {
        let shown = name.chars().filter(|&c| !invisible(c)).take(LONGEST_NAME).collect();
        return Err(NameError::Invisible { what, shown, code: c as u32, place: place + 1 });
    }
    if name.trim().is_empty() {
        return Err(NameError::Blank { what, name: name.chars().take(LONGEST_NAME).collect() });
    }
    let length = name.chars().count();
    if length > LONGEST_NAME {
        let start = name.chars().take(20).collect();
        return Err(NameError::TooLong { what, start, length });
    }
    Ok(())
}

/// Control characters, marks that change the direction of text, and blanks of no width.
fn invisible(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{00AD}' | '\u{061C}' | '\u{180E}' | '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}'
            | '\u{2060}'..='\u{206F}' | '\u{FEFF}' | '\u{FFF9}'..='\u{FFFB}' | '\u{E0000}'..='\u{E007F}')
        || matches!(c as u32 & 0xFFFE, 0xFFFE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_trade_pass() {
        for name in
            ["tetrapod 5t", "消波ブロック 5t型", "Accropode™ II 4 m³", "C-1 (old)", "=A1", "née"]
        {
            assert_eq!(check_name("the name", name), Ok(()), "{name}");
        }
    }

    #[test]
    fn names_nobody_can_read_are_refused() {
        let long = "x".repeat(LONGEST_NAME + 1);
        for name in [
            "",
            "  ",
            "\t",
            "a\nb",
            "a\u{1}",
            "a\u{202E}b",
            "\u{FEFF}a",
            "\u{3000}",
            &long,
            "\u{FFFE}",
        ] {
            assert!(check_name("the name", name).is_err(), "{name:?}");
        }
        let message = check_name("the name of block 2", "a\u{202E}b").unwrap_err().to_string();
        assert!(message.contains("block 2") && message.contains("U+202E"), "{message}");
    }
}
