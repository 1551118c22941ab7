//! Materials, as far as more than one format supports them.
//!
//! The model is the metallic-roughness model of glTF, limited to what MTL can represent too:
//!
//! | [`Material`] | glTF | MTL |
//! |---|---|---|
//! | `base_color` | `baseColorFactor` | `Kd` |
//! | `opacity`, `alpha` | 4th component, `alphaMode`, `alphaCutoff` | `d` (or 1 − `Tr`), `map_d` |
//! | `metallic` | `metallicFactor` | `Pm` |
//! | `roughness` | `roughnessFactor` | `Pr`, or else 1 − √(`Ns` / 1000) |
//! | `emission` | `emissiveFactor` × `emissiveStrength` | `Ke` |
//! | `is_double_sided` | `doubleSided` | – |
//! | `base_color_texture` | `baseColorTexture` | `map_Kd` |
//! | `emission_texture` | `emissiveTexture` | `map_Ke` |
//! | `normal_texture` | `normalTexture` | `norm` |
//!
//! Colours are linear in glTF and in no stated colour space in MTL. They are copied without
//! conversion, as in Blender and assimp. A texture is multiplied by its factor in both formats; a
//! factor that MTL omits is white. Texture coordinates are those of the [`UV`](crate::UV)
//! attribute, whose second component points up.

mod image;
mod names;

use std::collections::BTreeSet;

pub(crate) use image::stem;
pub use image::{Image, ImageKind};
pub(crate) use names::{file_stem, unique_names};

use crate::attributes::{Attributes, LabelKind};

/// The materials of a document and the images of their textures.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Materials {
    /// The material for each name among the labels of kind
    /// [`Material`](crate::LabelKind::Material), in the same order, followed by those that no
    /// face uses.
    ///
    /// Empty if only the names are known.
    pub list: Vec<Material>,
    /// The images used by textures, each once.
    pub images: Vec<Image>,
    /// Material contents of the file that this model cannot represent.
    pub(crate) others: BTreeSet<String>,
}

/// The appearance of the faces that have this material.
#[derive(Clone, PartialEq, Debug)]
pub struct Material {
    /// The name.
    pub name: String,
    /// Colour of the surface, or the factor of its texture; linear, from 0 to 1.
    pub base_color: [f32; 3],
    /// From 0 (invisible) to 1 (opaque); ignored if `alpha` is [`Alpha::Opaque`].
    pub opacity: f32,
    /// The use of the opacity and of the alpha of the base-colour texture.
    pub alpha: Alpha,
    /// From 0 (dielectric) to 1 (metal).
    pub metallic: f32,
    /// From 0 (mirror) to 1 (rough).
    pub roughness: f32,
    /// Emitted light; linear, not negative.
    pub emission: [f32; 3],
    /// `true` if back faces are visible too.
    pub is_double_sided: bool,
    /// The image of the base colour, as an index into [`Materials::images`].
    pub base_color_texture: Option<usize>,
    /// The image of the emission.
    pub emission_texture: Option<usize>,
    /// The image of the normals in tangent space.
    pub normal_texture: Option<usize>,
}

/// The use of the opacity of a material.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[non_exhaustive]
pub enum Alpha {
    /// The surface is opaque regardless of its opacity.
    #[default]
    Opaque,
    /// The surface is visible where the opacity is at least this cutoff.
    Mask(f32),
    /// The background shows through.
    Blend,
}

impl Material {
    /// Creates a rough white material.
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            base_color: [1.0; 3],
            opacity: 1.0,
            alpha: Alpha::Opaque,
            metallic: 0.0,
            roughness: 1.0,
            emission: [0.0; 3],
            is_double_sided: false,
            base_color_texture: None,
            emission_texture: None,
            normal_texture: None,
        }
    }

    /// The images of all textures.
    pub fn textures(&self) -> impl Iterator<Item = usize> {
        let textures = [
            self.base_color_texture,
            self.emission_texture,
            self.normal_texture,
        ];
        textures.into_iter().flatten()
    }

    pub(crate) fn textures_mut(&mut self) -> [&mut Option<usize>; 3] {
        [
            &mut self.base_color_texture,
            &mut self.emission_texture,
            &mut self.normal_texture,
        ]
    }
}

impl Materials {
    /// Creates materials whose textures are indices into `images`.
    pub fn new(list: Vec<Material>, images: Vec<Image>) -> Self {
        Self {
            list,
            images,
            others: BTreeSet::new(),
        }
    }

    /// Material contents of the file that this model cannot represent.
    pub fn others(&self) -> impl Iterator<Item = &str> {
        self.others.iter().map(String::as_str)
    }

    /// Returns `true` if no material is known.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Sorts the images by first use in the textures, and removes unused ones.
    pub(crate) fn with_images_in_order(mut self) -> Self {
        let mut numbers = vec![None; self.images.len()];
        let mut images = Vec::new();
        for material in &mut self.list {
            for texture in material.textures_mut() {
                *texture = texture.and_then(|old| {
                    let image = self.images.get(old)?;
                    let number = numbers.get_mut(old)?;
                    Some(*number.get_or_insert_with(|| {
                        images.push(image.clone());
                        images.len() - 1
                    }))
                });
            }
        }
        self.images = images;
        self
    }

    /// Lists what a format without materials drops in addition to the names.
    pub(crate) fn lost_altogether(&self, attributes: &Attributes) -> Vec<String> {
        let mut lost = Vec::new();
        // If faces have materials, the loss of the labels is reported instead.
        if !self.list.is_empty() && attributes.label(LabelKind::Material).is_none() {
            lost.push("materials".to_owned());
        }
        match self.images.len() {
            0 => {}
            1 => lost.push("the image of a texture".to_owned()),
            n => lost.push(format!("{n} images of textures")),
        }
        if self.list.is_empty() {
            lost.extend(self.others.iter().cloned());
        }
        lost
    }

    /// Describes the first inconsistent or out-of-range value.
    pub(crate) fn misfit(&self, attributes: &Attributes) -> Option<String> {
        let labels = attributes.label(LabelKind::Material);
        let num_names = labels.map_or(0, |labels| labels.names.len());
        if !self.list.is_empty() && self.list.len() < num_names {
            return Some(format!(
                "there are {} materials for {num_names} names of materials",
                self.list.len()
            ));
        }
        self.list.iter().find_map(|material| {
            let name = &material.name;
            let unit = |x: &f32| (0.0..=1.0).contains(x);
            let is_unit = material.base_color.iter().all(unit)
                && [material.opacity, material.metallic, material.roughness]
                    .iter()
                    .all(unit);
            if !is_unit {
                return Some(format!("the material `{name}` has a number beyond 0 to 1"));
            }
            let is_light = |x: &f32| *x >= 0.0 && x.is_finite();
            let is_cutoff = |alpha| !matches!(alpha, Alpha::Mask(x) if !is_light(&x));
            if !material.emission.iter().all(is_light) || !is_cutoff(material.alpha) {
                return Some(format!("the material `{name}` has a negative number"));
            }
            let missing = material.textures().find(|&i| i >= self.images.len());
            missing.map(|i| format!("the material `{name}` has no image {i} for its texture"))
        })
    }
}

/// Joins words or names into one phrase: `a, b and c`; long lists are shortened.
pub(crate) fn listed(names: &[String]) -> String {
    const MOST: usize = 12;
    match names {
        [] => String::new(),
        [name] => name.clone(),
        names if names.len() > MOST => {
            let more = names.len() - MOST;
            format!("{} and {more} more", names[..MOST].join(", "))
        }
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
