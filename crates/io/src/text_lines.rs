//! Lines of a text file whatever its encoding and line ends: UTF-8, UTF-16 with or without its mark, Shift-JIS, Latin; LF, CR LF
//! or CR alone. Read piece by piece.

use crate::input::Input;
use crate::{IoError, Place};
use encoding_rs::{
    Decoder, DecoderResult, Encoding, SHIFT_JIS, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252,
};
use std::collections::VecDeque;

const PIECE: usize = 1 << 16;
/// What is looked at to find the encoding.
const HEAD: usize = 1 << 16;

/// Steps through the lines of a file.
pub struct TextLines {
    decoder: Decoder,
    encoding: &'static Encoding,
    /// Decoded text that is not handed on yet.
    pending: String,
    /// Where in it the next line begins.
    from: usize,
    /// The end of the file is reached.
    ended: bool,
    line: u64,
    limit: usize,
    /// Lines that were looked at and put back.
    kept: VecDeque<(u64, String)>,
}

impl TextLines {
    /// From the beginning of the file; a line longer than `limit` bytes is an error.
    pub fn new(input: &mut Input, limit: usize) -> Result<Self, IoError> {
        let head = input.len.min(HEAD as u64);
        let head = input.take(head, "the text")?;
        if head.starts_with(&[0xff, 0xfe, 0, 0]) || head.starts_with(&[0, 0, 0xfe, 0xff]) {
            return Err(input.malformed(Place::File, "the text is UTF-32; save the file as UTF-8"));
        }
        let whole = head.len() as u64 == input.len;
        let encoding = encoding_of(&head, whole);
        input.go_to(0, "the text")?;
        Ok(Self {
            decoder: encoding.new_decoder_with_bom_removal(),
            encoding,
            pending: String::new(),
            from: 0,
            ended: false,
            line: 0,
            limit,
            kept: VecDeque::new(),
        })
    }

    /// Name of the encoding, when it is worth a word: not UTF-8.
    pub fn unusual_encoding(&self) -> Option<&'static str> {
        (self.encoding != UTF_8).then(|| self.encoding.name())
    }

    /// The next line with its number, from 1; `None` at the end.
    pub fn next(&mut self, input: &mut Input) -> Result<Option<(u64, String)>, IoError> {
        if let Some(line) = self.kept.pop_front() {
            return Ok(Some(line));
        }
        self.fresh(input)
    }

    /// The next `count` lines at most; they come again from [`Self::next`].
    pub fn look_ahead(
        &mut self,
        input: &mut Input,
        count: usize,
    ) -> Result<&[(u64, String)], IoError> {
        while self.kept.len() < count {
            let Some(line) = self.fresh(input)? else { break };
            self.kept.push_back(line);
        }
        Ok(self.kept.make_contiguous())
    }

    fn fresh(&mut self, input: &mut Input) -> Result<Option<(u64, String)>, IoError> {
        let mut searched = self.from;
        loop {
            let found = self.pending[searched..].find(['\n', '\r']).map(|i| searched + i);
            // A CR at the very end may be the first half of CR LF.
            let whole = found.filter(|&i| {
                self.ended || !self.pending[i..].starts_with('\r') || i + 1 < self.pending.len()
            });
            if let Some(end) = whole {
                let line = self.pending[self.from..end].to_string();
                let long = if self.pending[end..].starts_with("\r\n") { 2 } else { 1 };
                self.from = end + long;
                return self.counted(input, line).map(Some);
            }
            if self.ended {
                if self.from == self.pending.len() {
                    return Ok(None);
                }
                let line = self.pending[self.from..].to_string();
                self.from = self.pending.len();
                return self.counted(input, line).map(Some);
            }
            self.pending.drain(..self.from);
            self.from = 0;
            searched = found.unwrap_or(self.pending.len()).min(self.pending.len());
            if self.pending.len() > self.limit {
                return Err(self.too_long(input));
            }
            self.read_on(input)?;
        }
    }

    fn counted(&mut self, input: &Input, line: String) -> Result<(u64, String), IoError> {
        if line.len() > self.limit {
            return Err(self.too_long(input));
        }
        self.line += 1;
        Ok((self.line, line))
    }

    fn too_long(&self, input: &Input) -> IoError {
        let limit = self.limit;
        input.malformed(
            Place::Line(self.line + 1),
            format!("the line is longer than {limit} bytes; this is not a text file of the expected kind"),
        )
    }

    fn read_on(&mut self, input: &mut Input) -> Result<(), IoError> {
        let left = input.len.saturating_sub(input.position()?);
        let piece = input.take(left.min(PIECE as u64), "the text")?;
        self.ended = piece.len() as u64 == left;
        let most = self.decoder.max_utf8_buffer_length_without_replacement(piece.len());
        self.pending.reserve(most.unwrap_or(4 * PIECE));
        let (result, _) = self.decoder.decode_to_string_without_replacement(
            &piece,
            &mut self.pending,
            self.ended,
        );
        match result {
            DecoderResult::InputEmpty => Ok(()),
            _ => {
                let decoded = self.pending[self.from..].replace("\r\n", "\n");
                let lines = decoded.matches(['\n', '\r']).count() as u64;
                let encoding = self.encoding.name();
                let what = format!("the line is not text in {encoding}; save the file as UTF-8");
                Err(input.malformed(Place::Line(self.line + 1 + lines), what))
            }
        }
    }
}

/// The encoding by its mark, by the zeros between Latin letters, or by what can be decoded.
fn encoding_of(head: &[u8], whole: bool) -> &'static Encoding {
    if let Some((encoding, _)) = Encoding::for_bom(head) {
        return encoding;
    }
    let zeros = |from: usize| head.iter().skip(from).step_by(2).filter(|&&b| b == 0).count();
    let (even, odd) = (zeros(0), zeros(1));
    let many = head.len() / 5; // of each half: digits and separators have a zero, other letters may not
    if odd > many && even < many / 4 {
        return UTF_16LE;
    }
    if even > many && odd < many / 4 {
        return UTF_16BE;
    }
    match std::str::from_utf8(head) {
        Ok(_) => UTF_8,
        // A letter cut in two at the end of what was looked at.
        Err(e) if e.error_len().is_none() && !whole => UTF_8,
        Err(_) if is_latin(head) => WINDOWS_1252,
        Err(_) => {
            let (_, faults) = SHIFT_JIS.decode_without_bom_handling(head);
            if faults && whole { UTF_8 } else { SHIFT_JIS }
        }
    }
}

/// Whether bytes beyond ASCII stand alone and none begins a kanji or kana: umlauts and accents, not Japanese.
fn is_latin(head: &[u8]) -> bool {
    let high = |b: &u8| *b >= 0x80;
    !head.iter().any(|b| (0x81..=0x9f).contains(b)) && !head.windows(2).any(|w| w.iter().all(high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn lines(bytes: &[u8]) -> Result<Vec<String>, String> {
        let mut input = Input::of_bytes(Path::new("a.txt"), bytes);
        let mut text = TextLines::new(&mut input, 1 << 16).map_err(|e| e.to_string())?;
        text.look_ahead(&mut input, 2).map_err(|e| e.to_string())?;
        let mut out = Vec::new();
        while let Some((n, line)) = text.next(&mut input).map_err(|e| e.to_string())? {
            out.push(line);
            assert_eq!(n, out.len() as u64);
        }
        Ok(out)
    }

    #[test]
    fn every_line_end_ends_a_line() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["a 1", "b 2", "", "c 3"].join(end);
            assert_eq!(lines(text.as_bytes()).unwrap(), ["a 1", "b 2", "", "c 3"], "{end:?}");
            assert_eq!(lines(format!("{text}{end}").as_bytes()).unwrap().len(), 4);
        }
        // Line ends across the pieces that are read.
        for end in ["\n", "\r\n", "\r"] {
            let text: String = (0..20_000).map(|i| format!("{i} 2 3{end}")).collect();
            assert_eq!(lines(text.as_bytes()).unwrap().len(), 20_000);
        }
        assert!(lines(b"").unwrap().is_empty());
    }

    #[test]
    fn encodings_are_found() {
        let text = "X座標,標高\r\n1.5,2\r\n";
        let utf_16 = |big: bool, mark: bool| -> Vec<u8> {
            let mark = mark.then_some(0xfeff);
            let units = mark.into_iter().chain("X,Y,Z\r\n1.5,2,3\r\n".encode_utf16());
            units.flat_map(|u| if big { u.to_be_bytes() } else { u.to_le_bytes() }).collect()
        };
        assert_eq!(lines(text.as_bytes()).unwrap(), ["X座標,標高", "1.5,2"]);
        assert_eq!(lines(&SHIFT_JIS.encode(text).0).unwrap(), ["X座標,標高", "1.5,2"]);
        for (big, mark) in [(false, false), (false, true), (true, false), (true, true)] {
            assert_eq!(lines(&utf_16(big, mark)).unwrap(), ["X,Y,Z", "1.5,2,3"], "{big} {mark}");
        }
        assert_eq!(
            lines(b"Rechtswert;H\xf6he\r\n1,5;2\r\n").unwrap(),
            ["Rechtswert;Höhe", "1,5;2"]
        );
        let utf_32 = [0xff, 0xfe, 0, 0, b'x', 0, 0, 0];
        assert!(lines(&utf_32).unwrap_err().contains("UTF-32"));
        let error = lines(b"1 2 3\n\xff\xff\xff 2\n").unwrap_err();
        assert!(error.contains("line 2") && error.contains("UTF-8"), "{error}");
    }
}
