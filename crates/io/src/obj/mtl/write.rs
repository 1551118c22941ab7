//! A new MTL file.
//!
//! Roughness and metalness are written with the statements for physically based materials (`Pr`,
//! `Pm`), and `Ns` in addition for readers that know only the highlight. A texture whose alpha is
//! used is also named by `map_d`.

use std::collections::BTreeSet;

use super::read::exponent;
use crate::material::{Alpha, Material, Materials, unique_names};
use crate::number::push_f32;

/// Writes the text of a library.
///
/// `names` are those of the materials, `images` the files of the images.
pub(in crate::obj) fn write(materials: &Materials, names: &[String], images: &[String]) -> String {
    let mut out = String::new();
    for (material, name) in materials.list.iter().zip(names) {
        if !out.is_empty() {
            out.push('\n');
        }
        out.push_str("newmtl ");
        out.push_str(name);
        if name.ends_with('\\') {
            // The next line would continue this one.
            out.push(' ');
        }
        out.push('\n');
        row(&mut out, "Kd", &material.base_color);
        if material.emission != [0.0; 3] || material.emission_texture.is_some() {
            row(&mut out, "Ke", &material.emission);
        }
        let opacity = if material.alpha == Alpha::Opaque {
            1.0
        } else {
            material.opacity
        };
        row(&mut out, "d", &[opacity]);
        row(&mut out, "Ns", &[exponent(material.roughness)]);
        row(&mut out, "Pr", &[material.roughness]);
        row(&mut out, "Pm", &[material.metallic]);
        out.push_str("illum 2\n");
        let alpha = material
            .base_color_texture
            .filter(|_| material.alpha != Alpha::Opaque);
        for (keyword, texture) in [
            ("map_Kd", material.base_color_texture),
            ("map_d", alpha),
            ("map_Ke", material.emission_texture),
            ("norm", material.normal_texture),
        ] {
            if let Some(image) = texture.and_then(|image| images.get(image)) {
                out.push_str(&format!("{keyword} {image}\n"));
            }
        }
    }
    out
}

/// Lists the material data that an MTL cannot represent.
pub(in crate::obj) fn losses(materials: &Materials) -> Vec<String> {
    let mut lost = BTreeSet::new();
    for material in &materials.list {
        lost.extend(of_material(material));
    }
    let names = material_names(materials);
    let is_renamed = materials
        .list
        .iter()
        .zip(&names)
        .any(|(material, name)| material.name != *name);
    if is_renamed {
        lost.insert("names of materials that an MTL cannot tell apart (they get numbers)");
    }
    lost.into_iter().map(str::to_owned).collect()
}

fn of_material(material: &Material) -> impl Iterator<Item = &'static str> {
    let is_opaque = material.opacity >= 1.0;
    let alpha = match material.alpha {
        Alpha::Opaque if !is_opaque => Some("the opacity of opaque materials"),
        Alpha::Mask(_) => Some("the alpha cutoffs of materials (alphaMode MASK)"),
        Alpha::Blend if is_opaque && material.base_color_texture.is_none() => {
            Some("the blending of materials without transparency (alphaMode BLEND)")
        }
        _ => None,
    };
    let sides = material
        .is_double_sided
        .then_some("the display of back faces (doubleSided)");
    alpha.into_iter().chain(sides)
}

/// The names of the materials in a form that OBJ and MTL can represent, each once.
pub(in crate::obj) fn material_names(materials: &Materials) -> Vec<String> {
    let held = |name: &str| -> String {
        let name = name.trim_matches(|c: char| c <= ' ');
        name.replace(['\n', '\r'], " ")
    };
    let names: Vec<String> = materials.list.iter().map(|m| held(&m.name)).collect();
    unique_names(names.iter().map(String::as_str), "material", |name| {
        let stands = !name.is_empty() && name != "(null)";
        stands.then(|| name.to_owned())
    })
}

fn row(out: &mut String, keyword: &str, numbers: &[f32]) {
    out.push_str(keyword);
    for &x in numbers {
        out.push(' ');
        push_f32(out, x);
    }
    out.push('\n');
}
