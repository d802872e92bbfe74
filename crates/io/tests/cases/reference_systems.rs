//! Which system, which unit: said by the file, obeyed or refused by name.

use crate::las_file::Las;
use crate::{heap, read};
use io::crs::{self, FileCrs};
use scene::Severity;

const WKT: (&str, u16) = ("LASF_Projection", 2112);

fn las_with(wkt: &str) -> Vec<u8> {
    let las = Las { vlrs: vec![(WKT.0, WKT.1, wkt.as_bytes().to_vec())], ..Las::default() };
    las.bytes(&heap(50).iter().map(|p| las.record(*p, 1, 0, 0)).collect::<Vec<_>>())
}

/// What a site in zone XI says of a file.
fn refusals(reference: &FileCrs) -> String {
    let all = crs::disagreements("EPSG:6679", &[("a.laz".into(), reference.clone())]);
    let refused = all.iter().filter(|c| c.severity == Severity::Refusal);
    refused.map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn crs_of_zone_9_las() {
    let (cloud, _) = read("las", &las_with(&crs::wkt_of_epsg(6677).unwrap())).unwrap();
    let said = refusals(&cloud.reference);
    assert!(said.contains("6677") && said.contains("6679"), "{said}");
    let (same, _) = read("las", &las_with(&crs::wkt_of_epsg(6679).unwrap())).unwrap();
    assert_eq!(refusals(&same.reference), "");
}

#[test]
fn crs_by_esri_text_by_keys_and_by_comment() {
    let esri = r#"PROJCS["JGD_2011_Japan_Zone_9",GEOGCS["GCS_JGD_2011",DATUM["D_JGD_2011",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",139.8333333333333],PARAMETER["Scale_Factor",0.9999],PARAMETER["Latitude_Of_Origin",36.0],UNIT["Meter",1.0]]"#;
    let (cloud, _) = read("las", &las_with(esri)).unwrap();
    assert!(refusals(&cloud.reference).contains("6677"));
    let las = Las {
        encoding: 0,
        vlrs: vec![("LASF_Projection", 34735, crs::keys_of_epsg(6677))],
        ..Las::default()
    };
    let (cloud, _) = read("las", &las.bytes(&[las.record(heap(1)[0], 1, 0, 0)])).unwrap();
    assert!(refusals(&cloud.reference).contains("6677"));
    let ply = "ply\nformat ascii 1.0\ncomment crs EPSG:6677\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\nend_header\n1 2 3\n";
    assert!(refusals(&read("ply", ply.as_bytes()).unwrap().0.reference).contains("6677"));
    let pcd = "# .PCD v0.7\n# EPSG:6677\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n";
    assert!(refusals(&read("pcd", pcd.as_bytes()).unwrap().0.reference).contains("6677"));
}

#[test]
fn crs_in_evlr() {
    let wkt = crs::wkt_of_epsg(6679).unwrap();
    let las = Las { evlrs: vec![(WKT.0, WKT.1, wkt.into_bytes())], ..Las::default() };
    let (cloud, _) = read("las", &las.bytes(&[las.record(heap(1)[0], 1, 0, 0)])).unwrap();
    assert_eq!(cloud.crs.as_deref(), Some("EPSG:6679"));
}

#[test]
fn degrees_are_refused() {
    for wkt in [
        r#"GEOGCS["JGD2011",DATUM["x",SPHEROID["y",6378137,298]],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","6668"]]"#,
        r#"GEOGCRS["WGS 84",DATUM["x",ELLIPSOID["y",6378137,298]],CS[ellipsoidal,2],ID["EPSG",4326]]"#,
    ] {
        let (cloud, _) = read("las", &las_with(wkt)).unwrap();
        assert!(refusals(&cloud.reference).contains("degrees"));
    }
}

#[test]
fn heights_in_feet_compound() {
    let plane = crs::wkt_of_epsg(6679).unwrap();
    for (unit, factor, name) in [
        (r#"UNIT["US survey foot",0.304800609601219]"#, 1200.0 / 3937.0, "US survey foot"),
        (r#"UNIT["foot",0.3048]"#, 0.3048, "international foot"),
    ] {
        let wkt = format!(
            r#"COMPD_CS["a",{plane},VERT_CS["NAVD88 height",VERT_DATUM["x",2005],{unit},AXIS["Up",UP]]]"#
        );
        let (cloud, said) = read("las", &las_with(&wkt)).unwrap();
        let expected = heap(50)[7];
        assert!((cloud.position[7].z - expected.z * factor).abs() < 1e-3, "{name}");
        assert!((cloud.position[7].x - expected.x).abs() < 1e-3);
        assert!(said.contains(name), "{said}");
        assert_eq!(refusals(&cloud.reference), "");
    }
}

#[test]
fn plane_coordinates_in_feet_are_refused_by_name() {
    let wkt = crs::wkt_of_epsg(6679).unwrap().replace(
        r#"UNIT["metre",1,AUTHORITY["EPSG","9001"]],AXIS"#,
        r#"UNIT["US survey foot",0.304800609601219],AXIS"#,
    );
    let (cloud, _) = read("las", &las_with(&wkt)).unwrap();
    assert!(refusals(&cloud.reference).contains("US survey foot"));
    // A code alone tells too.
    assert!(refusals(&FileCrs::of_code(2227)).contains("US survey foot"));
}

#[test]
fn depths_counted_downwards_become_heights() {
    let plane = crs::wkt_of_epsg(6679).unwrap();
    let wkt = format!(
        r#"COMPD_CS["a",{plane},VERT_CS["MSL depth",VERT_DATUM["x",2005],UNIT["metre",1],AXIS["Depth",DOWN],AUTHORITY["EPSG","5715"]]]"#
    );
    let (cloud, said) = read("las", &las_with(&wkt)).unwrap();
    assert!((cloud.position[7].z + heap(50)[7].z).abs() < 1e-3);
    assert!(said.contains("depths"), "{said}");
}

/// PROJ strings name no code, often no datum; they were passed over.
#[test]
fn proj_strings_in_comments() {
    let rows: String = heap(5).iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    let said = |head: &str| {
        refusals(&read("xyz", format!("# {head}\n{rows}").as_bytes()).unwrap().0.reference)
    };
    let tmerc = |lon: &str| {
        format!("+proj=tmerc +lat_0={lon} +k=0.9999 +x_0=0 +y_0=0 +ellps=GRS80 +units=m +no_defs")
    };
    assert!(said(&tmerc("36 +lon_0=139.833333333333")).contains("6677"));
    assert_eq!(said(&tmerc("44 +lon_0=140.25")), "");
    assert!(said("+proj=longlat +datum=WGS84 +no_defs").contains("degrees"));
    assert!(said("+proj=lcc +lat_0=36.5 +units=us-ft").contains("US survey foot"));
    assert!(said("exported in EPSG:6677").contains("6677"));
    // Two codes do not say which one the numbers are in.
    assert_eq!(said("from EPSG:6677 to EPSG:6679"), "");
}

/// Formats without a place for a system have it beside them.
#[test]
fn prj_file_beside_a_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    let rows: String = heap(5).iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    std::fs::write(&path, rows).unwrap();
    assert!(io::points::reference(&path).unwrap().is_unstated());
    std::fs::write(path.with_extension("prj"), crs::wkt_of_epsg(6677).unwrap()).unwrap();
    assert_eq!(io::points::reference(&path).unwrap().horizontal, Some(6677));
    let cloud = io::points::read(&path, &geom::Silent).unwrap();
    assert_eq!(cloud.crs.as_deref(), Some("EPSG:6677"));
}
