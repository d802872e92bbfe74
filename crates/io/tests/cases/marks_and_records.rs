//! What a surveyor has marked is left out; what he has recorded comes back with the labels.

use crate::las_file::Las;
use crate::{heap, read};
use geom::Silent;
use io::relabel::{self, PointLabels, Records, SiteFromFile};
use io::{LeaveOut, ReadOptions, points};
use scene::{PointFlag, PointMark};
use std::path::{Path, PathBuf};

/// Twelve points: every third one marked in its own way.
fn marked(format: u8, marks: &[(u8, u8)]) -> Vec<u8> {
    let las = Las { format, minor: if format < 6 { 2 } else { 4 }, ..Las::default() };
    let mark = |i: usize| if i % 3 == 2 { marks[i / 3 % marks.len()] } else { (2, 0) };
    let records: Vec<_> =
        heap(12).iter().enumerate().map(|(i, p)| las.record(*p, mark(i).0, mark(i).1, 0)).collect();
    las.bytes(&records)
}

#[test]
fn noise_class_7_18() {
    let (cloud, said) = read("las", &marked(6, &[(7, 0), (18, 0)])).unwrap();
    assert_eq!(cloud.len(), 8);
    assert_eq!(cloud.record.as_ref().unwrap(), &[0, 1, 3, 4, 6, 7, 9, 10]);
    assert!(said.contains("2 of class 7 (noise)") && said.contains("2 of class 18"), "{said}");
}

#[test]
fn withheld_points_and_water_in_old_and_new_formats() {
    for format in [0, 1, 3, 6, 7] {
        let (cloud, said) = read("las", &marked(format, &[(2, 4), (9, 0)])).unwrap();
        assert_eq!(cloud.len(), 8, "{format}");
        assert!(said.contains("2 withheld") && said.contains("2 of class 9 (water)"), "{said}");
    }
    // Synthetic and key points are surface.
    assert_eq!(read("las", &marked(6, &[(2, 1), (2, 2)])).unwrap().0.len(), 12);
}

#[test]
fn leave_out_and_keep_are_obeyed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    std::fs::write(&path, marked(6, &[(9, 0), (5, 0), (7, 0), (2, 1)])).unwrap();
    let count = |out: &[PointMark], keep: &[PointMark]| {
        let options = ReadOptions { leave_out: LeaveOut::with(out, keep), ..ReadOptions::survey() };
        points::read_with(&path, &options, &Silent).unwrap().len()
    };
    assert_eq!(count(&[], &[]), 10);
    assert_eq!(count(&[], &[PointMark::Class(9)]), 11);
    assert_eq!(count(&[PointMark::Class(5), PointMark::Flag(PointFlag::Synthetic)], &[]), 8);
}

#[test]
fn a_cloud_of_water_alone_says_so() {
    let las = Las::default();
    let records: Vec<_> = heap(5).iter().map(|p| las.record(*p, 9, 0, 0)).collect();
    let error = read("las", &las.bytes(&records)).unwrap_err();
    assert!(error.contains("5 of class 9 (water)") && error.contains("keep"), "{error}");
}

#[test]
fn label_minus_1() {
    let ply = |label: &str, values: [&str; 2]| {
        let [a, b] = values;
        format!(
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\nproperty float {label}\nend_header\n1 2 3 {a}\n4 5 6 {b}\n"
        )
    };
    assert_eq!(
        read("ply", ply("label", ["-1", "-1"]).as_bytes()).unwrap().0.instance,
        Some(vec![0, 0])
    );
    assert_eq!(
        read("ply", ply("scalar_label", ["3", "-1"]).as_bytes()).unwrap().0.instance,
        Some(vec![3, 0])
    );
    // Labels of a survey are not used: whatever stands there does no harm.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, ply("label", ["nan", "0.5"])).unwrap();
    assert!(points::read(&path, &Silent).is_err());
    let survey = points::read_with(&path, &ReadOptions::survey(), &Silent).unwrap();
    assert_eq!((survey.len(), survey.instance), (2, None));
}

#[test]
fn laz_formats_4_and_5_and_all_others() {
    for format in 0..=10_u8 {
        let las = Las { format, minor: if format < 6 { 3 } else { 4 }, extra: 3, ..Las::default() };
        let records: Vec<_> =
            heap(300).iter().enumerate().map(|(i, p)| las.record(*p, 2, 0, i as u8)).collect();
        let (cloud, _) =
            read("laz", &las.compressed(&records)).unwrap_or_else(|e| panic!("{format}: {e}"));
        assert_eq!(cloud.len(), 300);
        assert!((cloud.position[123] - heap(300)[123]).length() < 1e-3, "{format}");
    }
}

fn labels<'a>(record: &'a [u32], columns: &'a (Vec<u32>, Vec<u16>, Vec<f32>)) -> PointLabels<'a> {
    PointLabels { record, instance: &columns.0, model: &columns.1, confidence: &columns.2 }
}

fn columns(n: usize) -> (Vec<u32>, Vec<u16>, Vec<f32>) {
    let id = |i: usize| i as u32 + 1;
    ((0..n).map(id).collect(), vec![1; n], (0..n).map(|i| i as f32 / 100.0).collect())
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Raw records of a plain LAS file.
fn raw(path: &Path) -> (Vec<u8>, usize) {
    let bytes = std::fs::read(path).unwrap();
    let at = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
    let size = usize::from(u16::from_le_bytes(bytes[105..107].try_into().unwrap()));
    let count = u64::from_le_bytes(bytes[247..255].try_into().unwrap());
    let count = if bytes[25] < 4 {
        u64::from(u32::from_le_bytes(bytes[107..111].try_into().unwrap()))
    } else {
        count
    };
    (bytes[at..at + size * count as usize].to_vec(), size)
}

#[test]
fn attributes_format_7() {
    let folder = tempfile::tempdir().unwrap();
    for format in 0..=10_u8 {
        let descriptor = {
            let mut d = vec![0; 192];
            (d[2], d[4]) = (3, b'q'); // two bytes called q; the third byte is undescribed
            d
        };
        let las = Las {
            format,
            minor: if format < 6 { 3 } else { 4 },
            extra: 3,
            vlrs: vec![("LASF_Spec", 4, descriptor), ("somebody", 7, vec![1, 2, 3])],
            evlrs: if format < 6 { vec![] } else { vec![("somebody", 8, vec![4; 70_000])] },
            ..Las::default()
        };
        // Values that do not repeat, marked points among them.
        let records: Vec<_> = heap(400)
            .iter()
            .enumerate()
            .map(|(i, p)| las.record(*p, if i % 10 == 0 { 7 } else { 5 }, 0, (i * 7) as u8))
            .collect();
        let source = written(folder.path(), "a.las", &las.bytes(&records));
        let cloud = points::read(&source, &Silent).unwrap();
        assert_eq!(cloud.len(), 360);
        let found = columns(360);
        let found = labels(cloud.record.as_ref().unwrap(), &found);
        for out in ["out.las", "out.laz"] {
            let out = folder.path().join(out);
            relabel::write(&out, &source, &found, &SiteFromFile::default(), Records::All).unwrap();
            let back = points::read_with(&out, &ReadOptions::every_point(), &Silent).unwrap();
            let instance = back.instance.as_ref().unwrap();
            assert_eq!(
                (back.len(), instance[0], instance[1], instance[11]),
                (400, 0, 1, 10),
                "{format}"
            );
            if out.extension().unwrap() == "las" {
                let (bytes, size) = raw(&out);
                let old = las.record_bytes();
                assert_eq!(size, old + 10);
                for (new, record) in bytes.chunks_exact(size).zip(&records) {
                    assert_eq!(&new[..old], record.as_slice(), "{format}");
                }
            }
            // Other records of the file are there still, once.
            let whole = std::fs::read(&out).unwrap();
            let times = |part: &[u8]| whole.windows(part.len()).filter(|w| *w == part).count();
            assert_eq!(times(b"somebody"), if format < 6 { 1 } else { 2 });
            assert_eq!(whole[25], las.minor);
            // Labelled again, the labels are not there twice.
            let again = folder.path().join("again.laz");
            relabel::write(&again, &out, &found, &SiteFromFile::default(), Records::All).unwrap();
            let summary = |p: &Path| io::las::summary(&mut io::Input::open(p).unwrap()).unwrap();
            assert_eq!(summary(&again).record_bytes, summary(&out).record_bytes);
        }
    }
}

#[test]
fn labelled_las_lies_in_site_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let las = Las::default();
    let records: Vec<_> = heap(60).iter().map(|p| las.record(*p, 2, 0, 9)).collect();
    let source = written(folder.path(), "a.las", &las.bytes(&records));
    let found = columns(20);
    let record: Vec<u32> = (10..30).collect();
    let to_site =
        SiteFromFile { swap: true, height_factor: 0.3048, vertical_offset_m: 1.5, epsg: None };
    let out = folder.path().join("b.laz");
    relabel::write(&out, &source, &labels(&record, &found), &to_site, Records::Labelled).unwrap();
    let back = points::read(&out, &Silent).unwrap();
    assert_eq!(back.len(), 20);
    let (there, here) = (heap(60)[12], back.position[2]);
    assert!((here.x - there.y).abs() < 1e-3 && (here.y - there.x).abs() < 1e-3);
    assert!((here.z - (there.z * 0.3048 + 1.5)).abs() < 1e-3);
    let summary = io::las::summary(&mut io::Input::open(&out).unwrap()).unwrap();
    assert_eq!(summary.points, 20);
    let extent = back.extent().unwrap();
    assert!((summary.min - extent[0]).length() < 1e-3 && (summary.max - extent[1]).length() < 1e-3);
}

/// Cameras before the vertices, and a list in each vertex, as photogrammetry writes them.
#[test]
fn ply_with_lists_and_elements_before_its_vertices() {
    let folder = tempfile::tempdir().unwrap();
    let (places, found) = (heap(12), columns(12));
    let record: Vec<u32> = (0..12).collect();
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement camera 2\nproperty float a\nproperty short b\nelement vertex 12\nproperty list uchar ushort seen_by\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let mut text = header("ascii") + "0.5 7\n0.25 -7\n";
    let mut binary = header("binary_little_endian").into_bytes();
    for (a, b) in [(0.5_f32, 7_i16), (0.25, -7)] {
        binary.extend(a.to_le_bytes().into_iter().chain(b.to_le_bytes()));
    }
    for (i, p) in places.iter().enumerate() {
        let seen: Vec<u16> = (0..i as u16 % 4).collect();
        let words: String = seen.iter().map(|s| format!(" {s}")).collect();
        text += &format!("{}{words} {} {} {} {i}\n", seen.len(), p.x, p.y, p.z);
        binary.push(seen.len() as u8);
        seen.iter().for_each(|s| binary.extend(s.to_le_bytes()));
        p.to_array().iter().for_each(|v| binary.extend(v.to_le_bytes()));
        binary.push(i as u8);
    }
    text += "3 0 1 2\n";
    binary.push(3);
    [0_i32, 1, 2].iter().for_each(|v| binary.extend(v.to_le_bytes()));
    for (name, bytes) in [("a.ply", text.into_bytes()), ("b.ply", binary)] {
        let source = written(folder.path(), name, &bytes);
        let out = folder.path().join(format!("out-{name}"));
        let to_site = SiteFromFile { vertical_offset_m: 2.0, ..SiteFromFile::default() };
        relabel::write(&out, &source, &labels(&record, &found), &to_site, Records::All).unwrap();
        let back = points::read(&out, &Silent).unwrap();
        assert_eq!(back.instance.as_ref().unwrap(), &found.0, "{name}");
        assert!((back.position[7].z - places[7].z - 2.0).abs() < 1e-9, "{name}");
        let grown = std::fs::read(&out).unwrap().len() as i64 - bytes.len() as i64;
        let in_head = "property uint instance\nproperty ushort model\nproperty float confidence\n";
        // Ten bytes a vertex and three lines of header; texts grow by their words.
        if name == "b.ply" {
            assert_eq!(grown, 120 + in_head.len() as i64, "nothing else has changed");
        }
        // Labelled again, the old labels give way.
        let again = folder.path().join(format!("again-{name}"));
        let same = SiteFromFile::default();
        relabel::write(&again, &out, &labels(&record, &found), &same, Records::All).unwrap();
        assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(&out).unwrap(), "{name}");
        // A list longer than its file is a damage with a name.
        let cut = written(folder.path(), name, &bytes[..bytes.len() - 60]);
        let error = relabel::write(&again, &cut, &labels(&record, &found), &same, Records::All);
        assert!(error.unwrap_err().to_string().contains(name));
    }
}

#[test]
fn ply_and_pcd_keep_their_columns() {
    let folder = tempfile::tempdir().unwrap();
    let places = heap(40);
    let found = columns(40);
    let record: Vec<u32> = (0..40).collect();
    let ascii: String = places
        .iter()
        .enumerate()
        .map(|(i, p)| format!("{} {} {} {} 0.25\n", p.x, p.y, p.z, i % 256))
        .collect();
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment kept\nelement vertex 40\nproperty double x\nproperty double y\nproperty float z\nproperty uchar red\nproperty float other\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let binary = |big: bool| {
        let mut out =
            header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |b: &[u8]| {
            out.extend(if big { b.iter().rev().copied().collect::<Vec<_>>() } else { b.to_vec() })
        };
        for (i, p) in places.iter().enumerate() {
            put(&p.x.to_le_bytes());
            put(&p.y.to_le_bytes());
            put(&(p.z as f32).to_le_bytes());
            put(&[i as u8]);
            put(&0.25_f32.to_le_bytes());
        }
        put(&[3]);
        [0_i32, 1, 2].iter().for_each(|v| put(&v.to_le_bytes()));
        out
    };
    let files = [
        ("a.ply", (header("ascii") + &ascii + "3 0 1 2\n").into_bytes()),
        ("b.ply", binary(false)),
        ("c.ply", binary(true)),
        ("d.pcd", format!("# kept\nVERSION 0.7\nFIELDS x y z red other\nSIZE 8 8 4 1 4\nTYPE F F F U F\nCOUNT 1 1 1 1 1\nWIDTH 40\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 40\nDATA ascii\n{ascii}").into_bytes()),
    ];
    for (name, bytes) in files {
        let source = written(folder.path(), name, &bytes);
        for to_site in [
            SiteFromFile::default(),
            SiteFromFile { vertical_offset_m: 2.0, ..SiteFromFile::default() },
        ] {
            let out = folder.path().join(format!("out-{name}"));
            relabel::write(&out, &source, &labels(&record, &found), &to_site, Records::All)
                .unwrap();
            let back = points::read(&out, &Silent).unwrap();
            assert_eq!(back.instance.as_ref().unwrap(), &found.0, "{name}");
            let z = places[5].z + to_site.vertical_offset_m;
            assert!((back.position[5].z - z).abs() < 1e-6, "{name}");
            let text = String::from_utf8_lossy(&std::fs::read(&out).unwrap()).into_owned();
            assert!(
                text.contains("kept") && text.contains("red") && text.contains("other"),
                "{text}"
            );
            if name.ends_with("ply") {
                assert!(text.contains("element face 1") && text.contains("vertex_indices"));
            }
        }
    }
}

#[test]
fn pose_is_a_shift() {
    use e57::{E57Writer, Record, RecordValue, Transform};
    let file = |place: [f64; 3]| {
        let mut out = std::io::Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut out, "file").unwrap();
        let columns =
            vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
        let mut cloud = writer.add_pointcloud("scan", columns).unwrap();
        let mut pose = Transform::default();
        (pose.translation.x, pose.translation.y, pose.translation.z) =
            (place[0], place[1], place[2]);
        cloud.set_transform(Some(pose));
        for p in heap(50) {
            let local = p.to_array();
            let row = (0..3).map(|k| RecordValue::Double(local[k] - place[k])).collect();
            cloud.add_point(row).unwrap();
        }
        cloud.finalize().unwrap();
        writer.finalize().unwrap();
        drop(writer);
        out.into_inner()
    };
    let (cloud, said) = read("e57", &file([41_200.0, -98_700.0, 0.0])).unwrap();
    assert!(cloud.sensor_positions.is_empty() && said.contains("shift"), "{said}");
    let (cloud, _) = read("e57", &file([41_238.25, -98_771.5, 6.125])).unwrap();
    assert_eq!(cloud.sensor_positions.len(), 1);
    let pcd = |view: &str| {
        format!(
            "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nVIEWPOINT {view} 1 0 0 0\nPOINTS 2\nDATA ascii\n41250 -98760 2\n41253 -98761 3\n"
        )
    };
    assert!(read("pcd", pcd("41200 -98700 0").as_bytes()).unwrap().0.sensor_positions.is_empty());
    assert_eq!(
        read("pcd", pcd("41251.5 -98765.25 8.5").as_bytes()).unwrap().0.sensor_positions.len(),
        1
    );
}

/// Programs export classes as a column of other formats; noise in it was taken for surface.
#[test]
fn classes_in_columns_of_ply_pcd_and_text() {
    let points = heap(12);
    let row = |i: usize| {
        format!(
            "{} {} {} {}\n",
            points[i].x,
            points[i].y,
            points[i].z,
            if i % 3 == 2 { 7 } else { 1 }
        )
    };
    let rows: String = (0..12).map(row).collect();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 12\nproperty double x\nproperty double y\nproperty double z\nproperty float scalar_Classification\nend_header\n{rows}"
    );
    let pcd = format!(
        "VERSION .7\nFIELDS x y z classification\nSIZE 8 8 8 1\nTYPE F F F U\nWIDTH 12\nHEIGHT 1\nPOINTS 12\nDATA ascii\n{rows}"
    );
    let text = format!("X Y Z Classification\n{rows}");
    for (kind, bytes) in [("ply", ply), ("pcd", pcd), ("txt", text)] {
        let (cloud, said) = read(kind, bytes.as_bytes()).unwrap();
        assert_eq!(cloud.len(), 8, "{kind}");
        assert_eq!(cloud.record.as_ref().unwrap(), &[0, 1, 3, 4, 6, 7, 9, 10], "{kind}");
        assert_eq!((cloud.classes[&7], cloud.classes[&1]), (4, 8), "{kind}");
        assert!(said.contains("4 of class 7 (noise)"), "{kind}: {said}");
    }
}
