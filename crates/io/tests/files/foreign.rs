//! Files of kinds that we read but do not write, made by hand: E57, PCD, COPC, GeoTIFF of other programs.

use std::io::{Cursor, Write};

/// Point `i` of every file here.
pub fn place(i: usize) -> [f64; 3] {
    let t = i as f64;
    [(t * 0.37).sin() * 8.0, t * 0.03125, (i % 17) as f64 * 0.25]
}

/// Two scans of 150 points; the second one stands elsewhere, and one of its points is invalid.
pub fn e57() -> Vec<u8> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue, Transform};
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").unwrap();
    let state = RecordDataType::Integer { min: 0, max: 2 };
    let prototype = vec![
        Record::CARTESIAN_X_F64,
        Record::CARTESIAN_Y_F64,
        Record::CARTESIAN_Z_F64,
        Record { name: RecordName::CartesianInvalidState, data_type: state },
    ];
    for scan in 0..2_usize {
        let mut cloud = writer.add_pointcloud(&format!("scan {scan}"), prototype.clone()).unwrap();
        let mut pose = Transform::default();
        (pose.translation.x, pose.translation.y, pose.translation.z) =
            (100.0 * scan as f64, 5.0, 1.5);
        cloud.set_transform(Some(pose));
        for i in 0..150 {
            let invalid = i64::from(scan == 1 && i == 7) * 2;
            let mut row: Vec<_> = place(i).map(RecordValue::Double).into();
            row.push(RecordValue::Integer(invalid));
            cloud.add_point(row).unwrap();
        }
        cloud.finalize().unwrap();
    }
    writer.finalize().unwrap();
    drop(writer);
    out.into_inner()
}

fn pcd_header(data: &str, points: usize) -> String {
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y rgb z label\nSIZE 4 4 1 8 4\nTYPE F F U F U\nCOUNT 1 1 3 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 1 2 30 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
}

/// Points 0–99 with label `i % 5`; point 3 has no measurement.
pub fn pcd(data: &str) -> Vec<u8> {
    let points = 100;
    let mut out = pcd_header(data, points).into_bytes();
    let value = |i: usize| if i == 3 { [f64::NAN; 3] } else { place(i) };
    let field = |i: usize, f: usize| -> Vec<u8> {
        let [x, y, z] = value(i);
        match f {
            0 => (x as f32).to_le_bytes().into(),
            1 => (y as f32).to_le_bytes().into(),
            2 => vec![9, 8, 7],
            3 => z.to_le_bytes().into(),
            _ => ((i % 5) as u32).to_le_bytes().into(),
        }
    };
    match data {
        "ascii" => {
            for i in 0..points {
                let [x, y, z] = value(i);
                writeln!(out, "{} {} 9 8 7 {z} {}", x as f32, y as f32, i % 5).unwrap();
            }
        }
        "binary" => (0..points).for_each(|i| (0..5).for_each(|f| out.extend(field(i, f)))),
        _ => {
            let columns: Vec<u8> =
                (0..5).flat_map(|f| (0..points).flat_map(move |i| field(i, f))).collect();
            // The colour column repeats every three bytes: one literal run, then one back reference.
            let start = 8 * points;
            let mut packed = literals(&columns[..start + 3]);
            let mut left = 3 * points - 3;
            while left > 0 {
                let length = left.clamp(3, 264);
                left -= length;
                packed.extend([0xe0, (length - 2 - 7) as u8, 2]); // back 3 bytes
            }
            packed.extend(literals(&columns[start + 3 * points..]));
            out.extend((packed.len() as u32).to_le_bytes());
            out.extend((columns.len() as u32).to_le_bytes());
            out.extend(packed);
        }
    }
    out
}

fn literals(bytes: &[u8]) -> Vec<u8> {
    bytes.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect()
}

/// Two nodes of an octree over 0–16 m: points with x < 8 in one chunk, the rest in the other; the root is empty.
pub fn copc() -> Vec<u8> {
    use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
    let items = LazItemRecordBuilder::default_for_point_format_id(6, 0).unwrap();
    let vlr = LazVlrBuilder::new(items).with_variable_chunk_size().build();
    let mut vlr_data = Vec::new();
    vlr.write_to(&mut vlr_data).unwrap();
    let record = |user: &str, id: u16, data: &[u8]| {
        let mut r = vec![0; 54];
        r[2..2 + user.len()].copy_from_slice(user.as_bytes());
        r[18..20].copy_from_slice(&id.to_le_bytes());
        r[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
        r.extend(data);
        r
    };
    let (count, scale) = (200_u64, 0.001_f64);
    let data_at = 375 + 54 + 160 + 54 + vlr_data.len();
    let point = |i: usize, half: usize| {
        let [x, y, z] = place(i);
        let (x, y) = (x.abs() * 0.99 + 8.0 * half as f64, y.abs());
        let mut p = vec![0; 30];
        for (k, v) in [x, y, z].into_iter().enumerate() {
            p[4 * k..4 * k + 4].copy_from_slice(&((v / scale).round() as i32).to_le_bytes());
        }
        p[14] = 0x11;
        p
    };
    let mut cursor = Cursor::new(vec![0; data_at]);
    cursor.set_position(data_at as u64);
    let mut compressor = LasZipCompressor::new(cursor, vlr).unwrap();
    compressor.reserve_offset_to_chunk_table().unwrap();
    let mut ends = vec![data_at + 8];
    for half in 0..2 {
        let points: Vec<u8> = (0..100).flat_map(|i| point(i, half)).collect();
        compressor.compress_chunks([points]).unwrap();
        ends.push(compressor.get().position() as usize);
    }
    compressor.done().unwrap();
    let mut out = compressor.into_inner().into_inner();
    let page_at = out.len() as u64 + 60;
    let mut page = Vec::new();
    for (key, at, bytes, points) in [
        ([0, 0, 0, 0], 0, 0, 0),
        ([1, 0, 0, 0], ends[0], ends[1] - ends[0], 100),
        ([1, 1, 0, 0], ends[1], ends[2] - ends[1], 100),
    ] {
        key.iter().for_each(|k: &i32| page.extend(k.to_le_bytes()));
        page.extend((at as u64).to_le_bytes());
        page.extend((bytes as i32).to_le_bytes());
        page.extend(i32::to_le_bytes(points));
    }
    let mut info = Vec::new();
    for v in [8.0, 8.0, 8.0, 8.0, 0.1_f64] {
        info.extend(v.to_le_bytes());
    }
    info.extend(page_at.to_le_bytes());
    info.extend((page.len() as u64).to_le_bytes());
    info.resize(160, 0);
    let records =
        [record("copc", 1, &info), record(LazVlr::USER_ID, LazVlr::RECORD_ID, &vlr_data)].concat();
    out[375..data_at].copy_from_slice(&records);
    let mut put = |at: usize, bytes: &[u8]| out[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 4]);
    put(94, &375_u16.to_le_bytes());
    put(96, &(data_at as u32).to_le_bytes());
    put(100, &2_u32.to_le_bytes());
    put(104, &[0x86]);
    put(105, &30_u16.to_le_bytes());
    put(247, &count.to_le_bytes());
    (0..3).for_each(|axis| put(131 + 8 * axis, &scale.to_le_bytes()));
    out.extend([0; 60]); // header of the extended record that holds the page
    out.extend(page);
    out
}
