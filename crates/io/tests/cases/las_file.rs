//! LAS and LAZ files of any format, byte by byte: what other programs write and ours does not.

use geom::DVec3;

/// What a file is made of.
pub struct Las {
    pub format: u8,
    pub minor: u8,
    pub scale: f64,
    pub encoding: u16,
    /// User, id, content.
    pub vlrs: Vec<(&'static str, u16, Vec<u8>)>,
    pub evlrs: Vec<(&'static str, u16, Vec<u8>)>,
    /// Bytes behind the standard fields.
    pub extra: usize,
}

pub const BASE: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
pub const OFFSET: DVec3 = DVec3::new(41_250.0, -98_760.0, 0.0);

impl Default for Las {
    fn default() -> Self {
        Self {
            format: 6,
            minor: 4,
            scale: 0.001,
            encoding: 0x10,
            vlrs: vec![],
            evlrs: vec![],
            extra: 0,
        }
    }
}

impl Las {
    pub fn record_bytes(&self) -> usize {
        BASE[usize::from(self.format)] + self.extra
    }

    /// A record at this place; everything behind the coordinates is `fill`ed, with room for class and flags.
    pub fn record(&self, p: DVec3, class: u8, flags: u8, fill: u8) -> Vec<u8> {
        let mut r = vec![fill; self.record_bytes()];
        for (k, v) in ((p - OFFSET) / self.scale).round().to_array().into_iter().enumerate() {
            r[4 * k..4 * k + 4].copy_from_slice(&(v as i32).to_le_bytes());
        }
        if self.format < 6 {
            r[14] = 0x11 & 0x3f;
            r[15] = class | flags << 5;
        } else {
            r[14] = 0x11;
            r[15] = flags;
            r[16] = class;
        }
        r
    }

    /// The file, plain.
    pub fn bytes(&self, records: &[Vec<u8>]) -> Vec<u8> {
        self.file(&records.concat(), records.len(), false, &[])
    }

    /// The file, compressed as the library does it by itself.
    pub fn compressed(&self, records: &[Vec<u8>]) -> Vec<u8> {
        let items =
            laz::LazItemRecordBuilder::default_for_point_format_id(self.format, self.extra as u16)
                .unwrap();
        let vlr = laz::LazVlr::from_laz_items(items);
        let mut record = Vec::new();
        vlr.write_to(&mut record).unwrap();
        let head = self.file(&[], records.len(), true, &record);
        let at = head.len();
        let mut out = std::io::Cursor::new(head);
        out.set_position(at as u64);
        let mut compressor = laz::LasZipCompressor::new(out, vlr).unwrap();
        records.iter().for_each(|r| compressor.compress_one(r).unwrap());
        compressor.done().unwrap();
        compressor.into_inner().into_inner()
    }

    fn file(&self, points: &[u8], count: usize, compressed: bool, laszip: &[u8]) -> Vec<u8> {
        let header = [227, 227, 227, 235, 375][usize::from(self.minor)];
        let mut h = vec![0; header];
        let mut vlrs: Vec<(&str, u16, &[u8])> =
            self.vlrs.iter().map(|v| (v.0, v.1, v.2.as_slice())).collect();
        if compressed {
            vlrs.push(("laszip encoded", 22204, laszip));
        }
        let content: Vec<u8> = vlrs
            .iter()
            .flat_map(|(user, id, data)| {
                let mut head = vec![0; 54];
                head[2..2 + user.len()].copy_from_slice(user.as_bytes());
                head[18..20].copy_from_slice(&id.to_le_bytes());
                head[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
                [head, data.to_vec()].concat()
            })
            .collect();
        let data_at = header + content.len();
        let mut put = |at: usize, bytes: &[u8]| h[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, b"LASF");
        put(6, &self.encoding.to_le_bytes());
        put(24, &[1, self.minor]);
        put(94, &(header as u16).to_le_bytes());
        put(96, &(data_at as u32).to_le_bytes());
        put(100, &(vlrs.len() as u32).to_le_bytes());
        put(104, &[self.format | if compressed { 0x80 } else { 0 }]);
        put(105, &(self.record_bytes() as u16).to_le_bytes());
        put(107, &(count as u32).to_le_bytes());
        put(111, &(count as u32).to_le_bytes());
        for k in 0..3 {
            put(131 + 8 * k, &self.scale.to_le_bytes());
            put(155 + 8 * k, &OFFSET[k].to_le_bytes());
        }
        if self.minor >= 4 {
            put(247, &(count as u64).to_le_bytes());
            put(255, &(count as u64).to_le_bytes());
            if !self.evlrs.is_empty() {
                put(235, &((data_at + points.len()) as u64).to_le_bytes());
                put(243, &(self.evlrs.len() as u32).to_le_bytes());
            }
        }
        let mut out = [h, content, points.to_vec()].concat();
        for (user, id, data) in &self.evlrs {
            let mut head = vec![0; 60];
            head[2..2 + user.len()].copy_from_slice(user.as_bytes());
            head[18..20].copy_from_slice(&id.to_le_bytes());
            head[20..28].copy_from_slice(&(data.len() as u64).to_le_bytes());
            out.extend(head);
            out.extend(data);
        }
        out
    }
}
