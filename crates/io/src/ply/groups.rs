//! Grouping of PLY properties that together form one property of the mesh.

use crate::attributes::{COLOR, NORMAL, UV};

use super::layout::{Element, ElementKind, NumberType, Property};

/// A group of file properties that form one property of the mesh.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Group {
    /// [`NORMAL`], [`COLOR`], [`UV`], or the name in the file.
    pub(super) name: String,
    /// The indices of the element's properties, one per component; a list stands alone.
    pub(super) members: Vec<usize>,
    pub(super) number: NumberType,
    pub(super) is_list: bool,
}

/// The conventional names of normals.
pub(super) const NORMALS: [&str; 3] = ["nx", "ny", "nz"];
/// The conventional names of colours, in order of preference for writing.
pub(super) const COLORS: [[&str; 4]; 3] = [
    ["red", "green", "blue", "alpha"],
    [
        "diffuse_red",
        "diffuse_green",
        "diffuse_blue",
        "diffuse_alpha",
    ],
    ["r", "g", "b", "a"],
];
/// The conventional names of texture coordinates, in order of preference for writing.
pub(super) const UVS: [[&str; 2]; 4] = [
    ["s", "t"],
    ["u", "v"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
];

/// Groups the properties of an element that were not decoded when reading.
///
/// Groups with conventional names come first, then the others in file order.
pub(super) fn of(element: &Element) -> Vec<Group> {
    let mut groups = Vec::new();
    let mut taken = vec![false; element.properties.len()];
    groups.extend(normal(element));
    groups.extend(color(element));
    groups.extend(UVS.iter().find_map(|names| named(element, UV, names)));
    for group in &groups {
        for &member in &group.members {
            taken[member] = true;
        }
    }
    for (i, property) in element.properties.iter().enumerate() {
        let (number, is_list) = match *property {
            Property::Scalar(number) => (number, false),
            Property::List(_, item) => (item, true),
            Property::Coordinate(..) | Property::Corners(..) => continue,
        };
        if !taken[i] {
            groups.push(Group {
                name: plain_name(&element.names, i),
                members: vec![i],
                number,
                is_list,
            });
        }
    }
    groups
}

/// The normals of an element, if it has some and they have one type.
pub(super) fn normal(element: &Element) -> Option<Group> {
    named(element, NORMAL, &NORMALS)
}

fn color(element: &Element) -> Option<Group> {
    let is_color = |group: &Group| {
        matches!(
            group.number,
            NumberType::U8 | NumberType::U16 | NumberType::F32 | NumberType::F64
        )
    };
    COLORS.iter().find_map(|names| {
        named(element, COLOR, names)
            .or_else(|| named(element, COLOR, &names[..3]))
            .filter(is_color)
    })
}

/// Groups scalar properties of one type with these names.
fn named(element: &Element, name: &str, members: &[&str]) -> Option<Group> {
    let is_surface = matches!(element.kind, ElementKind::Vertex | ElementKind::Face);
    if !is_surface {
        return None;
    }
    let member = |name: &&str| element.names.iter().position(|n| n == name);
    let members: Vec<usize> = members.iter().map(member).collect::<Option<_>>()?;
    let number = |&i: &usize| match element.properties[i] {
        Property::Scalar(number) => Some(number),
        _ => None,
    };
    let first = number(members.first()?)?;
    let same = members.iter().all(|i| number(i) == Some(first));
    same.then(|| Group {
        name: name.to_owned(),
        members,
        number: first,
        is_list: false,
    })
}

/// The name in the file, changed if it could be mistaken for a conventional one.
fn plain_name(names: &[String], property: usize) -> String {
    let mut name = names[property].clone();
    while [NORMAL, COLOR, UV].contains(&name.as_str())
        || (name != names[property] && names.contains(&name))
    {
        name.push('_');
    }
    name
}
