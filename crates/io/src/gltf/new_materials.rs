//! The materials, textures and images of a new glTF, using the types of the `gltf` crate.
//!
//! Emission above 1 is scaled by the factor of `KHR_materials_emissive_strength`, a power of two,
//! so that the division is exact.

use gltf::json::material::{
    AlphaCutoff, AlphaMode, EmissiveFactor, Material as JsonMaterial, NormalTexture,
    PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf::json::texture::{Info, Texture};
use gltf::json::validation::Checked;
use gltf::json::{Image as JsonImage, Index, buffer, extensions, image};
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::IoError;
use crate::material::{Alpha, Image, Material};

/// The extension for emission above 1.
pub(super) const EMISSIVE_STRENGTH: &str = "KHR_materials_emissive_strength";

/// The members of the root that describe materials, each preceded by a comma; `views` are the
/// buffer views of the images.
pub(super) fn members(
    materials: &[Material],
    images: &[Image],
    views: &[usize],
) -> Result<String, IoError> {
    let mut out = String::new();
    let list: Vec<JsonMaterial> = materials.iter().map(material).collect();
    member(&mut out, "materials", &list)?;
    if !images.is_empty() {
        let textures: Vec<Texture> = (0..images.len()).map(texture).collect();
        member(&mut out, "textures", &textures)?;
        let images: Vec<JsonImage> = images.iter().zip(views).map(image).collect();
        member(&mut out, "images", &images)?;
    }
    if materials.iter().any(|material| strength(material) > 1.0) {
        member(&mut out, "extensionsUsed", &[EMISSIVE_STRENGTH])?;
    }
    Ok(out)
}

fn member<T: Serialize + ?Sized>(out: &mut String, key: &str, value: &T) -> Result<(), IoError> {
    // Names are text and numbers finite, so there is no reason for this to fail.
    let value = serde_json::to_string(value).map_err(|error| IoError::Gltf {
        path: key.to_owned(),
        problem: error.to_string(),
    })?;
    out.push_str(&format!(",\"{key}\":{value}"));
    Ok(())
}

fn material(material: &Material) -> JsonMaterial {
    let [r, g, b] = material.base_color;
    let (alpha_mode, alpha_cutoff) = match material.alpha {
        Alpha::Opaque => (AlphaMode::Opaque, None),
        Alpha::Mask(cutoff) => (AlphaMode::Mask, Some(AlphaCutoff(cutoff))),
        Alpha::Blend => (AlphaMode::Blend, None),
    };
    let strength = strength(material);
    let emission = material.emission.map(|x| (f64::from(x) / strength) as f32);
    let extension = (strength > 1.0).then(|| {
        let mut extension = extensions::material::Material::default();
        let value = json!({ "emissiveStrength": strength });
        extension.others.insert(EMISSIVE_STRENGTH.to_owned(), value);
        extension
    });
    JsonMaterial {
        name: Some(material.name.clone()),
        alpha_mode: Checked::Valid(alpha_mode),
        alpha_cutoff,
        double_sided: material.is_double_sided,
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([r, g, b, material.opacity]),
            base_color_texture: material.base_color_texture.map(info),
            metallic_factor: StrengthFactor(material.metallic),
            roughness_factor: StrengthFactor(material.roughness),
            ..PbrMetallicRoughness::default()
        },
        normal_texture: material.normal_texture.map(|image| NormalTexture {
            index: Index::new(image as u32),
            scale: 1.0,
            tex_coord: 0,
            extensions: None,
            extras: None,
        }),
        emissive_texture: material.emission_texture.map(info),
        emissive_factor: EmissiveFactor(emission),
        extensions: extension,
        ..JsonMaterial::default()
    }
}

/// The smallest power of two that is at least 1 and at least every component of the emission.
fn strength(material: &Material) -> f64 {
    let most = material.emission.into_iter().fold(1.0, f32::max);
    let mut strength = 1.0;
    while strength < f64::from(most) {
        strength *= 2.0;
    }
    strength
}

/// There is one texture per image, so they have the same indices.
fn info(image: usize) -> Info {
    Info {
        index: Index::new(image as u32),
        tex_coord: 0,
        extensions: None,
        extras: None,
    }
}

fn texture(image: usize) -> Texture {
    Texture {
        name: None,
        sampler: None,
        source: Index::new(image as u32),
        extensions: None,
        extras: None,
    }
}

fn image((image, &view): (&Image, &usize)) -> JsonImage {
    JsonImage {
        buffer_view: Some(Index::<buffer::View>::new(view as u32)),
        mime_type: Some(image::MimeType(image.kind().media_type().to_owned())),
        name: Some(image.name.clone()).filter(|name| !name.is_empty()),
        uri: None,
        extensions: None,
        extras: None,
    }
}

/// The emission of a material, given its factor and the value of the extension.
pub(super) fn emission(factor: [f32; 3], extension: Option<&Value>) -> [f32; 3] {
    let strength = extension.and_then(|value| value.get("emissiveStrength")?.as_f64());
    let strength = strength.unwrap_or(1.0);
    factor.map(|x| (f64::from(x) * strength) as f32)
}
