//! Words in both languages of the page, and characters that mean something to a browser made harmless.

/// The same words in English and Japanese; without Japanese, English stands for both.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text {
    /// English.
    pub en: String,
    /// Japanese; may be empty.
    pub ja: String,
}

impl Text {
    /// Both languages.
    pub fn new(en: impl Into<String>, ja: impl Into<String>) -> Self {
        Self { en: en.into(), ja: ja.into() }
    }

    /// The text as HTML: one span a language, of which the page shows one.
    pub fn html(&self) -> String {
        self.tagged("span", "")
    }

    /// The text as SVG `text` elements with the given attributes.
    pub(crate) fn svg(&self, attributes: &str) -> String {
        self.tagged("text", attributes)
    }

    fn tagged(&self, tag: &str, attributes: &str) -> String {
        if self.ja.is_empty() || self.ja == self.en {
            return format!("<{tag} {attributes}>{}</{tag}>", escape(&self.en)).replace(" >", ">");
        }
        let one = |lang: &str, words: &str| {
            format!("<{tag} lang=\"{lang}\" {attributes}>{}</{tag}>", escape(words))
        };
        (one("en", &self.en) + &one("ja", &self.ja)).replace(" >", ">")
    }
}

impl From<&str> for Text {
    fn from(en: &str) -> Self {
        Self::new(en, "")
    }
}

impl From<String> for Text {
    fn from(en: String) -> Self {
        Self::new(en, "")
    }
}

/// Text as HTML shows it, safe between tags and inside quoted attributes.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c if c.is_control() && c != '\n' && c != '\t' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

/// A number as people read it: `101558` → `101,558`. What is no plain number stays as it is.
pub fn grouped(number: &str) -> String {
    let (sign, rest) = number.strip_prefix('-').map_or(("", number), |rest| ("-", rest));
    let (whole, fraction) = rest.split_once('.').map_or((rest, None), |(w, f)| (w, Some(f)));
    let digits = |s: &str| !s.is_empty() && s.bytes().all(|b| b.is_ascii_digit());
    if !digits(whole) || fraction.is_some_and(|f| !digits(f)) {
        return number.into();
    }
    let mut text = String::from(sign);
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    if let Some(fraction) = fraction {
        text.push('.');
        text.push_str(fraction);
    }
    text
}

/// Shorthand for the page's own words.
pub(crate) fn t(en: &str, ja: &str) -> String {
    Text::new(en, ja).html()
}

#[cfg(test)]
mod tests {
    use super::grouped;

    #[test]
    fn only_numbers_are_grouped() {
        let texts = ["0", "999", "1000", "-62334.5", "101558", "1e9", "–", "", "No.3", "12."];
        let wanted = ["0", "999", "1,000", "-62,334.5", "101,558", "1e9", "–", "", "No.3", "12."];
        assert_eq!(texts.map(grouped), wanted);
    }
}
