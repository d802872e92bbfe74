//! How a text cloud separates its columns and writes its numbers: one separator and one decimal sign a file, decided from its
//! first lines. Where two readings are possible both are named.

use std::borrow::Cow;

/// What stands between two columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    Blank,
    Comma,
    Semicolon,
    Tab,
}

/// What stands before the decimals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decimal {
    Point,
    Comma,
}

/// Separator and decimal sign of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    pub separator: Separator,
    pub decimal: Decimal,
}

/// Full-width forms and typographic signs as their plain ones.
pub fn plain(line: &str) -> Cow<'_, str> {
    if line.is_ascii() {
        return Cow::Borrowed(line);
    }
    let one = |c: char| match c {
        '\u{ff01}'..='\u{ff5e}' => char::from_u32(c as u32 - 0xfee0).unwrap_or(c),
        '\u{3000}' => ' ',
        '\u{2212}' => '-',
        '\u{feff}' => ' ',
        c => c,
    };
    Cow::Owned(line.chars().map(one).collect())
}

/// A comment: what begins with `#`, `//`, `%` or `!`. The rest of the line.
pub fn comment(line: &str) -> Option<&str> {
    ["//", "#", "%", "!"].iter().find_map(|mark| line.strip_prefix(mark)).map(str::trim)
}

/// Whether a line holds numbers rather than names: at least half of its words look like numbers.
pub fn is_data(line: &str) -> bool {
    let words: Vec<&str> = line
        .split([',', ';', '\t', ' '])
        .map(|w| w.trim_matches(['"', ' ']))
        .filter(|w| !w.is_empty())
        .collect();
    let numeric = |w: &&&str| {
        w.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.'))
            || w.eq_ignore_ascii_case("nan")
            || w.eq_ignore_ascii_case("inf")
    };
    let count = words.iter().filter(numeric).count();
    count > 0 && count * 2 >= words.len()
}

impl Layout {
    /// From the lines of data among the first of the file. `Err` asks the question that only the user can answer.
    pub fn of(lines: &[&str]) -> Result<Self, String> {
        let all = |test: &dyn Fn(&str) -> bool| !lines.is_empty() && lines.iter().all(|l| test(l));
        let separator = if all(&|l| l.contains('\t')) {
            Separator::Tab
        } else if all(&|l| l.contains(';')) {
            Separator::Semicolon
        } else if all(&|l| l.contains(',')) && !all(&commas_inside_words) {
            Separator::Comma
        } else {
            Separator::Blank
        };
        let mut layout = Self { separator, decimal: Decimal::Point };
        let words: Vec<String> = lines
            .iter()
            .flat_map(|l| layout.split(l).into_iter().map(|w| w.into_owned()).collect::<Vec<_>>())
            .collect();
        if separator == Separator::Comma {
            commas_only_separate(lines, &layout)?;
        }
        layout.decimal = decimal(&words)?;
        Ok(layout)
    }

    /// The columns of a line, without quotes and blanks around them.
    pub fn split<'a>(&self, line: &'a str) -> Vec<Cow<'a, str>> {
        let trimmed = |w: &'a str| Cow::Borrowed(w.trim_matches(['"', ' ']));
        match self.separator {
            Separator::Blank => line.split_ascii_whitespace().map(trimmed).collect(),
            Separator::Semicolon => line.split(';').map(trimmed).collect(),
            Separator::Tab => line.split('\t').map(trimmed).collect(),
            Separator::Comma if line.contains('"') => quoted_columns(line),
            Separator::Comma => line.split(',').map(trimmed).collect(),
        }
    }

    /// A word as a number, groups of three digits taken together.
    pub fn number(&self, word: &str) -> Option<f64> {
        if let Ok(value) = word.parse()
            && (self.decimal == Decimal::Point || !word.contains('.'))
        {
            return Some(value);
        }
        let (sign, group) = match self.decimal {
            Decimal::Point => ('.', ','),
            Decimal::Comma => (',', '.'),
        };
        let (whole, decimals) = match word.split_once(sign) {
            Some((whole, decimals)) => (whole, Some(decimals)),
            None => (word, None),
        };
        let whole = ungrouped(whole, group)?;
        match decimals {
            Some(d) if d.contains([',', '.', ' ']) => None,
            Some(d) => format!("{whole}.{d}").parse().ok(),
            None => whole.parse().ok(),
        }
    }
}

/// Whole digits without the signs between their groups of three; `None` when the groups are not of three.
fn ungrouped(text: &str, group: char) -> Option<String> {
    let is_mark =
        |c: char| c == group || matches!(c, ' ' | '\u{a0}' | '\u{202f}' | '\u{2009}' | '\'' | '’');
    if !text.contains(is_mark) {
        return Some(text.to_string());
    }
    let mut parts = text.split(is_mark);
    let first = parts.next()?;
    let digits = first.trim_start_matches(['-', '+']);
    let three = |p: &str| p.len() == 3 && p.bytes().all(|b| b.is_ascii_digit());
    let sound = (1..=3).contains(&digits.len()) && digits.bytes().all(|b| b.is_ascii_digit());
    let rest: Vec<&str> = parts.collect();
    (sound && rest.iter().all(|p| three(p))).then(|| format!("{first}{}", rest.concat()))
}

/// Every comma of the line stands inside a word between digits, and there are words enough for a point.
fn commas_inside_words(line: &str) -> bool {
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let inside = |w: &&str| {
        !w.contains(',')
            || (w.split(',').all(|p| !p.is_empty())
                && w.bytes().all(|b| b.is_ascii_digit() || matches!(b, b',' | b'.' | b'-' | b'+')))
    };
    words.len() >= 3 && words.iter().all(inside)
}

/// Columns separated by commas, some in quotes.
fn quoted_columns(line: &str) -> Vec<Cow<'_, str>> {
    let (mut columns, mut word, mut quoted) = (Vec::new(), String::new(), false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => {
                columns.push(Cow::Owned(std::mem::take(&mut word).trim().to_string()))
            }
            c => word.push(c),
        }
    }
    columns.push(Cow::Owned(word.trim().to_string()));
    columns
}

/// `1,5,2,5,3,25`: whole numbers alone, an even count of six or more, may be decimals cut in two.
fn commas_only_separate(lines: &[&str], layout: &Layout) -> Result<(), String> {
    let whole = |w: &Cow<str>| w.parse::<i64>().is_ok();
    let halves = |l: &&str| {
        let words = layout.split(l);
        words.len() >= 6 && words.len().is_multiple_of(2) && words.iter().all(whole)
    };
    if lines.len() < 2 || !lines.iter().all(halves) {
        return Ok(());
    }
    let words = layout.split(lines[0]);
    Err(format!(
        "`{},{},…` can be read as the whole numbers {} and {}, or as {}.{} with a decimal comma; separate the columns with `;`, or write a decimal point",
        words[0], words[1], words[0], words[1], words[0], words[1]
    ))
}

/// The decimal sign of these words.
fn decimal(words: &[String]) -> Result<Decimal, String> {
    let is_number = |w: &&String| {
        w.bytes().any(|b| b.is_ascii_digit())
            && !w.bytes().any(|b| b.is_ascii_alphabetic() && b != b'e' && b != b'E')
    };
    let with_comma: Vec<&String> =
        words.iter().filter(is_number).filter(|w| w.contains(',')).collect();
    let last = |w: &str| w.rfind([',', '.']).map(|i| w.as_bytes()[i]);
    for word in &with_comma {
        if word.contains('.') {
            return Ok(if last(word) == Some(b',') { Decimal::Comma } else { Decimal::Point });
        }
    }
    if with_comma.iter().any(|w| w.matches(',').count() > 1) {
        return Ok(Decimal::Point);
    }
    let Some(first) = with_comma.first() else {
        let grouped = words.iter().filter(is_number).any(|w| w.matches('.').count() > 1);
        return Ok(if grouped { Decimal::Comma } else { Decimal::Point });
    };
    // A point in other words of the file settles it too.
    let pointed = words.iter().filter(is_number).filter(|w| w.contains('.'));
    if pointed.clone().any(|w| ungrouped(w, '.').is_none()) {
        return Ok(Decimal::Point);
    }
    let thousands = |w: &&&String| {
        let digits = w.trim_start_matches(['-', '+']);
        !digits.starts_with('0') && ungrouped(w, ',').is_some()
    };
    if with_comma.iter().all(|w| thousands(&w)) {
        return Err(format!(
            "`{first}` can be read as {} with a decimal comma, or as {} with thousands; write a decimal point, or take the commas out",
            first.replace(',', "."),
            first.replace(',', "")
        ));
    }
    Ok(Decimal::Comma)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(lines: &[&str]) -> Result<Vec<f64>, String> {
        let layout = Layout::of(lines)?;
        let words = layout.split(lines[0]);
        Ok(words.iter().map(|w| layout.number(w).unwrap_or(f64::NAN)).collect())
    }

    #[test]
    fn one_separator_and_one_decimal_sign_a_file() {
        let point = [41_247.5, -98_762.25, 3.4];
        for line in [
            "41247.5 -98762.25 3.4",
            "41247.5,-98762.25,3.4",
            "41247.5, -98762.25, 3.4",
            "41247,5;-98762,25;3,4",
            "41247,5\t-98762,25\t3,4",
            "41247,5  -98762,25 3,4",
            "41.247,5;-98.762,25;3,4",
            "\"41,247.5\",\"-98,762.25\",\"3.4\"",
            "41,247.5 -98,762.25 3.4",
            "41 247,5;-98 762,25;3,4",
            "41'247.5;-98'762.25;3.4",
            "41\u{a0}247,5;-98\u{a0}762,25;3,4",
            "4.12475e4 -9.876225E4 3.4",
        ] {
            assert_eq!(read(&[line, line]).unwrap(), point, "{line}");
        }
        assert_eq!(plain("４１２．５，−３"), "412.5,-3");
    }

    #[test]
    fn two_readings_are_a_question() {
        for lines in
            [["12,345 67,890 3,400", "12,346 67,891 3,401"], ["12,345;67,890;3,400", "1,1;1,2;1,3"]]
        {
            let answer = read(&lines);
            if lines[1].starts_with("1,1") {
                assert_eq!(answer.unwrap(), [12.345, 67.89, 3.4]); // settled by the second line
            } else {
                let question = answer.unwrap_err();
                assert!(question.contains("12.345") && question.contains("12345"), "{question}");
            }
        }
        let question = read(&["1,5,2,5,3,25", "4,5,6,0,7,0"]).unwrap_err();
        assert!(question.contains("1.5"), "{question}");
    }
}
