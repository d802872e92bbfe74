//! One small valid file of every kind, to damage.

use crate::{foreign, sample};
use geom::{DVec3, TriMesh, Vec3};
use io::RawCloud;

/// (kind, content) of each.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, write: &dyn Fn(&std::path::Path)| {
        let path = folder.path().join(name);
        write(&path);
        std::fs::read(path).unwrap()
    };
    let cloud = cloud(400);
    let plain = RawCloud { instance: None, model: None, confidence: None, ..cloud.clone() };
    let mesh = mesh();
    vec![
        ("ply", written("a.ply", &|p| io::points::write(p, &cloud).unwrap())),
        ("ply", ascii_ply().into_bytes()),
        ("ply", big_endian_ply()),
        ("las", written("a.las", &|p| io::points::write(p, &cloud).unwrap())),
        ("laz", written("a.laz", &|p| io::points::write(p, &cloud).unwrap())),
        ("laz", written("b.laz", &|p| io::points::write(p, &plain).unwrap())),
        ("laz", old_laz()),
        ("stl", written("a.stl", &|p| io::mesh::write(p, &mesh).unwrap())),
        ("stl", ascii_stl().into_bytes()),
        ("obj", written("a.obj", &|p| io::mesh::write(p, &mesh).unwrap())),
        ("mesh.ply", written("m.ply", &|p| io::mesh::write(p, &mesh).unwrap())),
        ("xyz", text_cloud().into_bytes()),
        ("pcd", foreign::pcd("ascii")),
        ("pcd", foreign::pcd("binary")),
        ("pcd", foreign::pcd("binary_compressed")),
        ("e57", foreign::e57()),
        ("copc.laz", foreign::copc()),
        ("laz", foreign::copc()),
        (
            "tif",
            written("a.tif", &|p| io::geotiff::write(p, &sample::raster(), "EPSG:6679").unwrap()),
        ),
        ("xml", io::landxml::text("a", "EPSG:6679", &[sample::surface("design")]).into_bytes()),
        // Our own drawing has its faces on frozen layers, which no reader takes for a design.
        ("alignment.dxf", io::dxf::text(&sample::sample().drawing()).into_bytes()),
        ("blocks.csv", BLOCKS.into()),
        ("placements.csv", PLACEMENTS.into()),
        ("site.toml", SITE.into()),
        ("catalog.toml", CATALOG.into()),
        ("review.json", REVIEW.into()),
        ("manifest.json", MANIFEST.into()),
        ("xyz", text_cloud().encode_utf16().flat_map(u16::to_le_bytes).collect()),
        ("xyz", JAPANESE.replace('\n', "\r").into()),
        ("xyz", PROJ.into()),
        ("ply", classed_ply().into_bytes()),
        ("xml", utf_16_design()),
        ("dxf", DRAWING.into()),
        ("alignment.xml", ALIGNMENT.into()),
        ("alignment.dxf", DRAWING.into()),
        ("labels.laz", written("l.laz", &|p| io::points::write(p, &cloud).unwrap())),
        ("labels.laz", old_laz()),
        ("labels.ply", written("l.ply", &|p| io::points::write(p, &cloud).unwrap())),
        ("labels.ply", ascii_ply().into_bytes()),
        ("labels.ply", listed_ply()),
        ("labels.pcd", foreign::pcd("binary_compressed")),
    ]
}

pub fn cloud(n: usize) -> RawCloud {
    let at = |i: usize| {
        let t = i as f64;
        DVec3::new(
            -35_678.0 + (t * 0.37).sin() * 40.0,
            -12_345.0 + t * 0.01,
            2.5 + (t * 0.11).cos(),
        )
    };
    RawCloud {
        position: (0..n).map(at).collect(),
        instance: Some((0..n).map(|i| (i % 7) as u32).collect()),
        model: Some((0..n).map(|i| (i % 3) as u16).collect()),
        confidence: Some((0..n).map(|i| i as f32 / n as f32).collect()),
        crs: Some("EPSG:6679".into()),
        ..RawCloud::default()
    }
}

fn mesh() -> TriMesh {
    let vertices =
        (0..40).map(|i| Vec3::new(i as f32 * 0.5, (i % 7) as f32, (i % 5) as f32)).collect();
    TriMesh { vertices, triangles: (2..40).map(|i| [i - 2, i - 1, i]).collect() }
}

fn text_cloud() -> String {
    let rows: String = (0..60)
        .map(|i| format!("{},{},{},{}\n", f64::from(i) * 0.25, i % 9, 3 - i % 4, i % 5))
        .collect();
    format!("# a cloud\nx,y,z,instance\n{rows}")
}

fn ascii_ply() -> String {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement extra 2\nproperty list uchar int v\nelement vertex 60\nproperty float x\nproperty float y\nproperty float z\nproperty int label\nend_header\n3 1 2 3\n0\n",
    );
    for i in 0..60 {
        text += &format!("{} {} {} {}\n", i as f32 * 0.25, i % 9, 3 - i % 4, i % 5);
    }
    text
}

/// Vertices with lists, behind another element.
fn listed_ply() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement camera 2\nproperty float a\nelement vertex 60\nproperty list uchar ushort seen\nproperty float x\nproperty double y\nproperty float z\nend_header\n".to_vec();
    bytes.extend([0; 8]);
    for i in 0..60_u8 {
        bytes.push(i % 4);
        bytes.extend(vec![i; 2 * usize::from(i % 4)]);
        bytes.extend(f32::from(i).to_le_bytes());
        bytes.extend(2.0_f64.to_le_bytes());
        bytes.extend((-1.0_f32).to_le_bytes());
    }
    bytes
}

fn classed_ply() -> String {
    let rows: String =
        (0..60).map(|i| format!("{} {} {} {}\n", i % 8, i / 8, i % 3, i % 5 + 5)).collect();
    format!(
        "ply\nformat ascii 1.0\ncomment proj4 +proj=utm +zone=54 +ellps=GRS80 +units=m\nelement vertex 60\nproperty double x\nproperty double y\nproperty double z\nproperty float scalar_Classification\nend_header\n{rows}"
    )
}

fn utf_16_design() -> Vec<u8> {
    let text = io::landxml::text("a", "EPSG:6679", &[sample::surface("design")])
        .replace("UTF-8", "UTF-16");
    std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
}

fn big_endian_ply() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement vertex 60\nproperty float x\nproperty float y\nproperty float z\nproperty ushort instance\nend_header\n".to_vec();
    for i in 0..60_u16 {
        for v in [f32::from(i), 2.0, -1.0] {
            bytes.extend(v.to_be_bytes());
        }
        bytes.extend((i % 4).to_be_bytes());
    }
    bytes
}

fn ascii_stl() -> String {
    let mut text =
        String::from("solid test of a text file that is longer than the header of a binary one\n");
    for i in 0..12 {
        text += &format!(
            "facet normal 0 0 1\nouter loop\nvertex {i} 0 0\nvertex 0 {i} 0\nvertex 0 0 1.5e0\nendloop\nendfacet\n"
        );
    }
    text + "endsolid\n"
}

/// LAS 1.2, point format 3, the older compression.
fn old_laz() -> Vec<u8> {
    use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr};
    let vlr =
        LazVlr::from_laz_items(LazItemRecordBuilder::default_for_point_format_id(3, 4).unwrap());
    let mut vlr_data = Vec::new();
    vlr.write_to(&mut vlr_data).unwrap();
    let (count, record) = (300_u32, 38_u16);
    let data_at = 227 + 54 + vlr_data.len();
    let mut out = vec![0; 227];
    let mut put = |at: usize, bytes: &[u8]| out[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227_u16.to_le_bytes());
    put(96, &(data_at as u32).to_le_bytes());
    put(100, &1_u32.to_le_bytes());
    put(104, &[0x83]);
    put(105, &record.to_le_bytes());
    put(107, &count.to_le_bytes());
    for axis in 0..3 {
        put(131 + 8 * axis, &0.001_f64.to_le_bytes());
    }
    let mut head = vec![0; 54];
    head[2..2 + LazVlr::USER_ID.len()].copy_from_slice(LazVlr::USER_ID.as_bytes());
    head[18..20].copy_from_slice(&LazVlr::RECORD_ID.to_le_bytes());
    head[20..22].copy_from_slice(&(vlr_data.len() as u16).to_le_bytes());
    out.extend(head);
    out.extend(vlr_data);
    let mut cursor = std::io::Cursor::new(out);
    cursor.set_position(data_at as u64);
    let mut compressor = LasZipCompressor::new(cursor, vlr).unwrap();
    for i in 0..count {
        let mut point = vec![0; record.into()];
        for (k, v) in [i * 37 % 1000, i * 11, i % 17].into_iter().enumerate() {
            point[4 * k..4 * k + 4].copy_from_slice(&v.to_le_bytes());
        }
        point[14] = 0x11;
        point[20] = (i % 7) as u8;
        compressor.compress_one(&point).unwrap();
    }
    compressor.done().unwrap();
    compressor.into_inner().into_inner()
}

const BLOCKS: &str = "block_id,model,x_m,y_m,z_m,qw,qx,qy,qz,occlusion,confidence,fitness_m,runner_up,runner_up_fitness_m\n1,tetrapod,-35600.25,-12300.5,1.5,1,0,0,0,0.25,0.9,0.01,cube,0.2\n2,\"a, b\",1,2,3,0.6,0.8,0,0,0.5,,,,\n";
const PLACEMENTS: &str = "order,round,model,drop_x_m,drop_y_m,drop_z_m,drop_qw,drop_qx,drop_qy,drop_qz,rest_x_m,rest_y_m,rest_z_m,rest_qw,rest_qx,rest_qy,rest_qz,filled_m3,contacts,state\n1,1,cube,1,2,3,1,0,0,0,1,2,2.5,0.6,0.8,0,0,1.25,3,kept\n";
const SITE: &str = "name = \"a\"\ncrs = \"EPSG:6679\"\nseed = 7\n[[survey]]\nfile = \"s.laz\"\nvertical_offset_m = 0.0\n[design]\nkind = \"section\"\nalignment = [[0.0, 0.0], [15.0, 0.0]]\ncrest_level_m = 4.0\ncrest_width_m = 6.0\nleft_slope_m = 1.5\nright_slope_m = 1.5\ntoe_level_m = -2.0\n";
const CATALOG: &str = "[[block]]\nname = \"tetrapod-2m\"\nshape = { kind = \"tetrapod\", size = 2.0 }\ndensity_kg_m3 = 2300.0\n\n[[block]]\nname = \"own\"\nmesh = \"own.stl\"\nunit = \"mm\"\n";
const REVIEW: &str = "{\n\"format\": 1,\n\"reviewer\": \"Sato\",\n\"blocks\": [{\"block_id\": 3, \"verdict\": \"rejected\", \"model\": \"tetrapod\", \"x_m\": -62000.5, \"y_m\": 1.0, \"z_m\": 2, \"qw\": 1, \"qx\": 0, \"qy\": 0, \"qz\": 0, \"fitness_m\": 0.02, \"occlusion\": 0.4, \"note\": \"seen\"}]\n}\n";
const MANIFEST: &str = "{\n\"format\": 1,\n\"version\": \"0.1.0\",\n\"seed\": 7,\n\"config\": {\"plan\": {\"policy\": \"search\", \"v\": [1.5, null]}},\n\"notes\": {\"weights\": \"shipped\"},\n\"inputs\": {\"site.toml\": {\"bytes\": 12, \"blake3\": \"00\"}},\n\"outputs\": {\"plan/placements.csv\": {\"bytes\": 3, \"blake3\": \"ff\"}}\n}\n";
const PROJ: &str = "# +proj=tmerc +lat_0=36 +lon_0=139.833333333333 +k=0.9999 +x_0=0 +y_0=0 +ellps=GRS80 +to_meter=1200/3937 +vunits=ft\n# PROJCS[\"a\",UNIT[\"metre\",1]]\nx y z classification\n1.5 2 3 1\n2.5 2 3 7\n2.5 3 3 1\n";
const JAPANESE: &str = "\u{70b9}\u{540d};\u{5317};\u{6771};\u{6a19}\u{9ad8}\nP1;-98760,5;41250,25;3,4\nP2;-98761,5;41251,25;2,4\nP3;-98762,5;41250,5;3,125\n";
const ALIGNMENT: &str = "<LandXML><Units><Metric linearUnit=\"meter\"/></Units><CoordinateSystem epsgCode=\"6679\"/><Alignments><Alignment name=\"CL\"><CoordGeom><Line><Start>0 0</Start><End>0 10</End></Line><Curve rot=\"ccw\"><Start>0 10</Start><Center>10 10</Center><End>10 20</End></Curve></CoordGeom></Alignment></Alignments></LandXML>";
const DRAWING: &str = "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n0\nLAYER\n2\nFG\n70\n0\n62\n3\n0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nB\n10\n0\n20\n0\n30\n0\n0\n3DFACE\n8\n0\n10\n0\n20\n0\n30\n1\n11\n4\n21\n0\n31\n1\n12\n0\n22\n4\n32\n1\n13\n0\n23\n4\n33\n1\n0\nENDBLK\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSERT\n8\nFG\n2\nB\n10\n1\n20\n2\n30\n3\n41\n2\n50\n30\n70\n3\n71\n2\n44\n5\n45\n5\n0\nPOLYLINE\n8\nFG\n66\n1\n70\n16\n71\n2\n72\n2\n0\nVERTEX\n8\nFG\n10\n0\n20\n0\n30\n4\n70\n64\n0\nVERTEX\n8\nFG\n10\n1\n20\n0\n30\n4\n70\n64\n0\nVERTEX\n8\nFG\n10\n0\n20\n1\n30\n4\n70\n64\n0\nVERTEX\n8\nFG\n10\n1\n20\n1\n30\n4\n70\n64\n0\nSEQEND\n0\nMESH\n8\nFG\n91\n0\n92\n3\n10\n0\n20\n0\n30\n4\n10\n1\n20\n0\n30\n4\n10\n1\n20\n1\n30\n4\n93\n4\n90\n3\n90\n0\n90\n1\n90\n2\n94\n0\n0\nLWPOLYLINE\n8\nCL\n90\n2\n70\n0\n10\n0\n20\n0\n42\n0.5\n10\n9\n20\n0\n0\nENDSEC\n0\nEOF\n";
