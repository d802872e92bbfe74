//! Tables as Markdown.

use std::fmt::Write;

/// Side a column's text stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table that grows by rows.
#[derive(Clone, Debug)]
pub struct Table {
    text: String,
    columns: usize,
}

impl Table {
    /// An empty table with these heads; the first column holds words, the others numbers.
    pub fn new(heads: &[&str]) -> Self {
        let aligned: Vec<(&str, Align)> = heads
            .iter()
            .enumerate()
            .map(|(i, h)| (*h, if i == 0 { Align::Left } else { Align::Right }))
            .collect();
        Self::aligned(&aligned)
    }

    /// An empty table with a side for every column.
    pub fn aligned(heads: &[(&str, Align)]) -> Self {
        let mut table = Self { text: String::new(), columns: heads.len() };
        table.line(heads.iter().map(|h| h.0.to_string()));
        table.line(
            heads.iter().map(|h| if h.1 == Align::Left { "---" } else { "---:" }.to_string()),
        );
        table
    }

    /// Adds a row; panics when it has another number of cells than the head, which is a mistake of the caller.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let cells: Vec<String> = cells.into_iter().collect();
        assert_eq!(cells.len(), self.columns, "a row has a cell for every column");
        self.line(cells);
    }

    fn line(&mut self, cells: impl IntoIterator<Item = String>) {
        for cell in cells {
            write!(self.text, "| {} ", cell.replace('|', "\\|")).expect("a string takes all text");
        }
        self.text.push_str("|\n");
    }

    /// The table's text, ending with a newline.
    pub fn finish(self) -> String {
        self.text
    }
}

/// A share as percent with one digit; a dash without one.
pub fn percent(share: Option<f64>) -> String {
    share.map_or("–".into(), |s| format!("{:.1}", s * 100.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_reads_as_markdown() {
        let mut table = Table::new(&["set", "P %"]);
        table.row(["a|b".to_string(), percent(Some(0.5))]);
        table.row(["c".to_string(), percent(None)]);
        assert_eq!(table.finish(), "| set | P % |\n| --- | ---: |\n| a\\|b | 50.0 |\n| c | – |\n");
    }
}
