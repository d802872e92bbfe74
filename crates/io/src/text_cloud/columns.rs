//! Which column of a text cloud is what, by its name: letters (x, y, z) follow the site's order of axes, words (Easting, 北,
//! 標高 …) decide for themselves.

use crate::crs::Unit;

/// What a column's name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    X,
    Y,
    Z,
    East,
    North,
    Up,
    Depth,
    Latitude,
    Longitude,
    Instance,
    Label,
    Model,
    Confidence,
    Class,
}

const ROLES: [(Role, &[&str]); 14] = [
    (Role::Latitude, &["lat", "latitude", "緯度"]),
    (Role::Longitude, &["lon", "lng", "long", "longitude", "経度"]),
    (
        Role::North,
        &[
            "north",
            "northing",
            "northings",
            "n",
            "北",
            "北距",
            "北方向",
            "緯距",
            "hochwert",
            "nord",
            "norte",
        ],
    ),
    (
        Role::East,
        &[
            "east",
            "easting",
            "eastings",
            "e",
            "東",
            "東距",
            "東方向",
            "経距",
            "rechtswert",
            "ost",
            "est",
            "este",
        ],
    ),
    (Role::Depth, &["depth", "depths", "水深", "深度", "深さ", "水深値"]),
    (
        Role::Up,
        &[
            "height",
            "elevation",
            "elev",
            "level",
            "up",
            "h",
            "alt",
            "altitude",
            "標高",
            "標高値",
            "高さ",
            "高度",
            "地盤高",
            "楕円体高",
            "höhe",
            "rl",
        ],
    ),
    (Role::X, &["x"]),
    (Role::Y, &["y"]),
    (Role::Z, &["z"]),
    (Role::Instance, &["instance"]),
    (Role::Label, &["label"]),
    (Role::Model, &["model"]),
    (Role::Confidence, &["confidence"]),
    (Role::Class, &["classification"]),
];

/// A name taken apart: what it says, and its unit.
struct Name {
    role: Option<Role>,
    unit: Option<Unit>,
    /// Nothing stands beside what it says: `height`, not `antenna height`.
    alone: bool,
}

fn name(text: &str) -> Name {
    let lower = text.trim_matches(['"', ' ', '\u{feff}']).to_lowercase();
    let mut words: Vec<String> = lower
        .split(|c: char| !(c.is_alphanumeric()))
        .filter(|w| !w.is_empty())
        .map(|w| {
            let core = ["座標値", "座標", "軸", "値"].iter().find_map(|tail| w.strip_suffix(tail));
            core.filter(|c| !c.is_empty()).unwrap_or(w).to_string()
        })
        .collect();
    // `X座標北` and the like: a letter with a direction behind it.
    for direction in ["北", "東", "標高"] {
        if lower.contains(direction) && !words.iter().any(|w| w == direction) {
            let inside =
                words.iter().any(|w| w.len() <= direction.len() + 8 && w.ends_with(direction));
            if inside {
                words.push(direction.into());
            }
        }
    }
    // A unit stands in brackets, or as the last word behind an underscore; `m` alone says metres, `h` a height.
    let unit = words.iter().skip(1).map(|w| Unit::of_word(w)).find(|u| u.metres.is_finite());
    let role = ROLES.iter().find(|(_, names)| words.iter().any(|w| names.contains(&w.as_str())));
    let alone = words.iter().skip(1).all(|w| Unit::of_word(w).metres.is_finite());
    Name { role: role.map(|r| r.0), unit, alone }
}

/// Places of the columns in a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Columns {
    /// First, second and third coordinate; east, north and up when `named_axes`.
    pub xyz: [usize; 3],
    /// The names say which axis is which.
    pub named_axes: bool,
    /// The third column counts downwards.
    pub depth: bool,
    pub instance: Option<usize>,
    /// What −1 stands for there: 0 where the instance is a `label`.
    pub minus_one: Option<u32>,
    pub model: Option<usize>,
    pub confidence: Option<usize>,
    /// Class as LAS numbers them.
    pub class: Option<usize>,
}

/// Why names give no columns.
#[derive(Debug, PartialEq)]
pub enum Unusable {
    /// One is missing.
    Missing(&'static str),
    /// The names are understood, but nothing can be done with them.
    Refused(String),
}

impl Columns {
    /// Without a header.
    pub const PLAIN: Self = Self {
        xyz: [0, 1, 2],
        named_axes: false,
        depth: false,
        instance: None,
        minus_one: None,
        model: None,
        confidence: None,
        class: None,
    };

    /// The same for a table in plan.
    pub const PLANE: Self = Self { xyz: [0, 1, 0], ..Self::PLAIN };

    /// From the names of a header; `plane`: heights are not needed.
    pub fn of<S: AsRef<str>>(names: &[S], plane_alone: bool) -> Result<Self, Unusable> {
        let read: Vec<Name> = names.iter().map(|n| name(n.as_ref())).collect();
        let find = |role: Role| read.iter().position(|n| n.role == Some(role));
        let only = |roles: &[Role]| only(names, &read, roles);
        if find(Role::Latitude).is_some()
            && find(Role::Longitude).is_some()
            && find(Role::X).is_none()
        {
            return Err(Unusable::Refused(
                "the columns are latitude and longitude; project the file into the site's plane coordinates".into(),
            ));
        }
        let letters = only(&[Role::X])?.zip(only(&[Role::Y])?);
        let words = only(&[Role::East])?.zip(only(&[Role::North])?);
        let (plane, named_axes) = match (letters, words) {
            (Some(_), Some(_)) => {
                return Err(Unusable::Refused(
                    "there are columns x, y and columns of east and north; take one pair out"
                        .into(),
                ));
            }
            (Some(letters), None) => (letters, false),
            (None, Some(words)) => (words, true),
            (None, None) => {
                let lone = |role: Role| find(role).is_some();
                return Err(Unusable::Missing(if lone(Role::East) {
                    "north"
                } else if lone(Role::North) {
                    "east"
                } else if lone(Role::X) {
                    "y"
                } else {
                    "x"
                }));
            }
        };
        let up = if plane_alone { None } else { only(&[Role::Z, Role::Up])? };
        let depth = find(Role::Depth);
        let none = plane_alone.then_some(plane.0);
        let third = none.or(up).or(depth).ok_or(Unusable::Missing("z"))?;
        let xyz = [plane.0, plane.1, third];
        for i in xyz {
            if let Some(unit) = read[i].unit.as_ref().filter(|u| !u.is_metre()) {
                return Err(Unusable::Refused(format!(
                    "the column `{}` is in the {unit}; convert it to metres",
                    names[i].as_ref().trim()
                )));
            }
        }
        let minus_one = find(Role::Instance).is_none().then_some(0);
        Ok(Self {
            xyz,
            named_axes,
            depth: up.is_none() && !plane_alone,
            instance: find(Role::Instance).or_else(|| find(Role::Label)),
            minus_one,
            model: find(Role::Model),
            confidence: find(Role::Confidence),
            class: find(Role::Class),
        })
    }
}

/// The one column with one of these roles, a name that says nothing else before others. Error: there are two, and nothing tells which
/// is meant.
fn only<S: AsRef<str>>(
    names: &[S],
    read: &[Name],
    roles: &[Role],
) -> Result<Option<usize>, Unusable> {
    let has = |i: &usize| read[*i].role.is_some_and(|r| roles.contains(&r));
    let all: Vec<usize> = (0..read.len()).filter(has).collect();
    let alone: Vec<usize> = all.iter().copied().filter(|&i| read[i].alone).collect();
    match (if alone.is_empty() { &all } else { &alone }).as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(*one)),
        [one, two, ..] => Err(Unusable::Refused(format!(
            "`{}` and `{}` may both be meant; take one column out, or give it a name that is no coordinate",
            names[*one].as_ref().trim(),
            names[*two].as_ref().trim()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_english_and_japanese_are_known() {
        let of = |line: &str| Columns::of(&line.split(',').collect::<Vec<_>>(), false);
        for (line, xyz, named) in [
            ("x,y,z", [0, 1, 2], false),
            ("Y,X,Z", [1, 0, 2], false),
            ("X座標,Y座標,標高", [0, 1, 2], false),
            ("No,X座標(m),Y座標(m),標高(m)", [1, 2, 3], false),
            ("点名,北,東,標高", [2, 1, 3], true),
            ("X(北),Y(東),Z", [1, 0, 2], true),
            ("X座標(北),Y座標(東),標高", [1, 0, 2], true),
            ("Northing,Easting,Elevation", [1, 0, 2], true),
            ("E [m],N [m],H [m]", [0, 1, 2], true),
            ("id,x_east,y_north,z_up", [1, 2, 3], true),
            ("N,X,Y,Z", [1, 2, 3], false), // a number, not a north
            ("X_m,Y_m,Z_m", [0, 1, 2], false),
            ("Rechtswert,Hochwert,Höhe", [0, 1, 2], true),
        ] {
            let columns = of(line).unwrap_or_else(|e| panic!("{line}: {e:?}"));
            assert_eq!((columns.xyz, columns.named_axes), (xyz, named), "{line}");
            assert!(!columns.depth);
        }
        // A name with a word beside it gives way to one without; two of a rank are asked about.
        assert_eq!(of("antenna height,x,y,z,normal x,normal y").unwrap().xyz, [1, 2, 3]);
        for line in [
            "x,y,z,height",
            "E,N,ellipsoidal height,orthometric height",
            "X座標,Y座標,標高,楕円体高",
            "x,y,z,x",
            "Easting,Northing,Easting (m),Z",
        ] {
            assert!(
                matches!(of(line), Err(Unusable::Refused(why)) if why.contains("both be meant")),
                "{line}"
            );
        }
        assert!(of("East,North,Depth").unwrap().depth);
        assert!(of("東,北,水深").unwrap().depth);
        assert_eq!(of("Easting,Northing"), Err(Unusable::Missing("z")));
        assert_eq!(of("a,b,c"), Err(Unusable::Missing("x")));
        for (line, part) in [
            ("緯度,経度,標高", "latitude"),
            ("x,y,z [ft]", "international foot"),
            ("X(mm),Y(mm),Z(mm)", "millimetre"),
            ("x,y,east,north,z", "one pair"),
        ] {
            assert!(matches!(of(line), Err(Unusable::Refused(m)) if m.contains(part)), "{line}");
        }
    }
}
