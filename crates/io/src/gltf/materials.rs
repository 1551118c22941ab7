//! The materials of a glTF and the images of their textures, using the types of the `gltf` crate.
//!
//! They are parsed one by one on request. An error in one affects only that material, never the
//! mesh.

use std::collections::{BTreeMap, BTreeSet};

use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::texture::{Info, Sampler, Texture, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Image as JsonImage, Index};
use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value};

use super::GltfFile;
use super::attributes::material_order;
use super::buffers::{data_of, decode};
use super::new_materials::{EMISSIVE_STRENGTH, emission};
use crate::attributes::Labels;
use crate::error::quote;
use crate::material::{Alpha, Image, Material, Materials, listed, stem};

/// The parts of the JSON that describe materials.
#[derive(Deserialize, Default)]
struct Look<'a> {
    #[serde(default, borrow)]
    materials: Vec<&'a RawValue>,
    #[serde(default, borrow)]
    textures: Vec<&'a RawValue>,
    #[serde(default, borrow)]
    images: Vec<&'a RawValue>,
    #[serde(default, borrow)]
    samplers: Vec<&'a RawValue>,
}

/// Reads the materials of a file: those of the labels first, in their order, then the others.
pub(super) fn materials(file: &GltfFile, labels: Option<&Labels>) -> Materials {
    let look: Look<'_> = serde_json::from_str(file.text()).unwrap_or_default();
    let mut reader = Reader {
        file,
        look: &look,
        budget: file.limits.max_memory.min(file.limits.max_bytes),
        images: BTreeMap::new(),
        materials: Materials::default(),
        extensions: BTreeSet::new(),
        textures: BTreeSet::new(),
    };
    let mut list: Vec<Option<Material>> = Vec::new();
    for (name, json) in file.materials.iter().zip(&look.materials) {
        list.push(Some(reader.material(name, json)));
    }
    let mut materials = reader.finish();
    let order = material_order(file);
    let names = labels.map_or(&[][..], |labels| &labels.names);
    let is_own = order.len() == names.len()
        && order
            .iter()
            .zip(names)
            .all(|(&number, name)| file.materials.get(number) == Some(name));
    for (index, name) in names.iter().enumerate() {
        // Labels that did not come from the file are matched by name.
        let number = match is_own {
            true => order.get(index).copied(),
            false => file.materials.iter().position(|own| own == name),
        };
        let own = number.and_then(|number| list.get_mut(number)?.take());
        let own = own.unwrap_or_else(|| Material::named(name));
        materials.list.push(own);
    }
    materials.list.extend(list.into_iter().flatten());
    materials.with_images_in_order()
}

struct Reader<'a> {
    file: &'a GltfFile,
    look: &'a Look<'a>,
    /// The number of image bytes that may still be copied.
    budget: u64,
    /// For each image of the file that a texture uses, its index.
    images: BTreeMap<usize, Option<usize>>,
    materials: Materials,
    extensions: BTreeSet<String>,
    /// The textures that a material refers to.
    textures: BTreeSet<usize>,
}

impl Reader<'_> {
    fn other(&mut self, text: impl Into<String>) {
        self.materials.others.insert(text.into());
    }

    fn material(&mut self, name: &str, json: &RawValue) -> Material {
        let mut material = Material::named(name);
        let parsed: JsonMaterial = match serde_json::from_str(json.get()) {
            Ok(parsed) => parsed,
            Err(error) => {
                let error = quote(error.to_string().as_bytes());
                self.other(format!(
                    "all but the name of the material `{}` ({error})",
                    quote(name.as_bytes())
                ));
                return material;
            }
        };
        let pbr = &parsed.pbr_metallic_roughness;
        let [r, g, b, a] = pbr.base_color_factor.0.map(|x| self.unit(x));
        material.base_color = [r, g, b];
        material.opacity = a;
        material.metallic = self.unit(pbr.metallic_factor.0);
        material.roughness = self.unit(pbr.roughness_factor.0);
        material.is_double_sided = parsed.double_sided;
        material.alpha = match parsed.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => Alpha::Opaque,
            Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
            Checked::Valid(AlphaMode::Mask) => {
                let cutoff = parsed.alpha_cutoff.unwrap_or_default().0;
                Alpha::Mask(self.light(cutoff))
            }
            Checked::Invalid => {
                self.other("unknown alpha modes");
                Alpha::Opaque
            }
        };
        let mut extensions = parsed.extensions.map(|e| e.others).unwrap_or_default();
        let strength = extensions.remove(EMISSIVE_STRENGTH);
        let emission = emission(parsed.emissive_factor.0, strength.as_ref());
        material.emission = emission.map(|x| self.light(x));
        self.note(&extensions);
        self.note(
            &pbr.extensions
                .as_ref()
                .map(|e| &e.others)
                .cloned()
                .unwrap_or_default(),
        );
        if parsed.extras.is_some() || pbr.extras.is_some() {
            self.other("application data (`extras`) of materials");
        }
        material.base_color_texture = self.info(pbr.base_color_texture.as_ref());
        material.emission_texture = self.info(parsed.emissive_texture.as_ref());
        if let Some(normal) = &parsed.normal_texture {
            if normal.scale != 1.0 {
                self.other("the scales of normal textures");
            }
            self.note(
                &normal
                    .extensions
                    .as_ref()
                    .map(|e| &e.others)
                    .cloned()
                    .unwrap_or_default(),
            );
            material.normal_texture = self.texture(normal.index, normal.tex_coord);
        }
        if let Some(texture) = &pbr.metallic_roughness_texture {
            self.note_texture(texture.index);
            self.other("metallic-roughness textures");
        }
        if let Some(texture) = &parsed.occlusion_texture {
            self.note_texture(texture.index);
            self.other("occlusion textures");
        }
        material
    }

    /// Clamps a number to the range 0 to 1, and records if it was outside.
    fn unit(&mut self, x: f32) -> f32 {
        if !(0.0..=1.0).contains(&x) {
            self.other("numbers of materials beyond 0 to 1");
        }
        if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) }
    }

    /// Replaces a negative or non-finite number by zero, and records it.
    fn light(&mut self, x: f32) -> f32 {
        if x >= 0.0 && x.is_finite() {
            return x;
        }
        self.other("negative numbers of materials");
        0.0
    }

    /// Records which extensions are present.
    fn note(&mut self, extensions: &Map<String, Value>) {
        let names = extensions.keys().map(|name| quote(name.as_bytes()));
        self.extensions.extend(names);
    }

    fn note_texture(&mut self, index: Index<Texture>) {
        if index.value() < self.look.textures.len() {
            self.textures.insert(index.value());
        }
    }

    fn info(&mut self, info: Option<&Info>) -> Option<usize> {
        let info = info?;
        self.note(&info.extensions.clone().unwrap_or_default().others);
        if info.extras.is_some() {
            self.other("application data (`extras`) of textures");
        }
        self.texture(info.index, info.tex_coord)
    }

    /// The image of a texture, if it uses the first set of texture coordinates.
    fn texture(&mut self, index: Index<Texture>, set: u32) -> Option<usize> {
        self.note_texture(index);
        if set != 0 {
            self.other("textures on a further set of texture coordinates");
            return None;
        }
        let json = self.look.textures.get(index.value());
        let parsed = json.and_then(|json| serde_json::from_str::<Texture>(json.get()).ok());
        let Some(texture) = parsed else {
            self.other("missing or invalid textures");
            return None;
        };
        self.note(&texture.extensions.map(|e| e.others).unwrap_or_default());
        if texture.name.is_some() {
            self.other("names of textures");
        }
        if texture.extras.is_some() {
            self.other("application data (`extras`) of textures");
        }
        if let Some(sampler) = texture.sampler {
            self.sampler(sampler);
        }
        if texture.source.value() == u32::MAX as usize {
            self.other("textures without a PNG or JPEG");
            return None;
        }
        self.image(texture.source.value())
    }

    fn sampler(&mut self, index: Index<Sampler>) {
        let json = self.look.samplers.get(index.value());
        let parsed = json.and_then(|json| serde_json::from_str::<Sampler>(json.get()).ok());
        let Some(sampler) = parsed else {
            self.other("missing or invalid samplers");
            return;
        };
        let repeats =
            |mode: &Checked<WrappingMode>| matches!(mode, Checked::Valid(WrappingMode::Repeat));
        if !(repeats(&sampler.wrap_s) && repeats(&sampler.wrap_t)) {
            self.other("the wrapping of textures (samplers)");
        }
        if sampler.mag_filter.is_some() || sampler.min_filter.is_some() {
            self.other("the filters of textures (samplers)");
        }
        if sampler.name.is_some() {
            self.other("names of samplers");
        }
        if sampler.extras.is_some() {
            self.other("application data (`extras`) of samplers");
        }
        self.note(&sampler.extensions.map(|e| e.others).unwrap_or_default());
    }

    /// An image of the file, copied on first use.
    fn image(&mut self, number: usize) -> Option<usize> {
        if let Some(&known) = self.images.get(&number) {
            return known;
        }
        let index = match self.copied(number) {
            Ok(image) => {
                self.materials.images.push(image);
                Some(self.materials.images.len() - 1)
            }
            Err(problem) => {
                self.other(format!("image {number} ({problem})"));
                None
            }
        };
        self.images.insert(number, index);
        index
    }

    fn copied(&mut self, number: usize) -> Result<Image, String> {
        let json = self.look.images.get(number);
        let json = json.ok_or("it is missing")?;
        let image: JsonImage = serde_json::from_str(json.get())
            .map_err(|error| quote(error.to_string().as_bytes()))?;
        self.note(&image.extensions.map(|e| e.others).unwrap_or_default());
        if image.extras.is_some() {
            self.other("application data (`extras`) of images");
        }
        let bytes = match (image.buffer_view, &image.uri) {
            (Some(view), _) => self.view(view.value())?,
            (None, Some(uri)) => self.file_of(uri)?,
            (None, None) => return Err("it has no bytes".to_owned()),
        };
        let rest = self.budget.checked_sub(bytes.len() as u64);
        self.budget = rest.ok_or("it is larger than the limit")?;
        let own = image.name.filter(|name| !name.is_empty());
        let uri = image.uri.as_deref().filter(|uri| !uri.contains(':'));
        let name = own.or_else(|| uri.map(|uri| stem(uri).to_owned()));
        let image = Image::new(name.unwrap_or_default(), bytes);
        image.ok_or_else(|| "it is neither a PNG nor a JPEG".to_owned())
    }

    /// The bytes of a data URI, or of a file next to this one.
    fn file_of(&self, uri: &str) -> Result<Vec<u8>, String> {
        if let Some(data) = data_of(uri) {
            return decode(data);
        }
        let bytes = self.file.files.bytes(uri, self.budget);
        let bytes = bytes.map_err(|error| error.to_string())?;
        let bytes = bytes.ok_or_else(|| format!("`{}` is missing", quote(uri.as_bytes())))?;
        Ok(bytes.to_vec())
    }

    /// The bytes of a buffer view.
    fn view(&self, number: usize) -> Result<Vec<u8>, String> {
        let bytes = self.file.views.get(number).and_then(|view| {
            let buffer = self.file.buffers.bytes(usize::try_from(view.buffer).ok()?);
            let start = usize::try_from(view.offset).ok()?;
            let end = start.checked_add(usize::try_from(view.length).ok()?)?;
            buffer.get(start..end)
        });
        let bytes = bytes.ok_or("its buffer view is missing")?;
        if bytes.len() as u64 > self.budget {
            return Err("it is larger than the limit".to_owned());
        }
        Ok(bytes.to_vec())
    }

    fn finish(self) -> Materials {
        let mut materials = self.materials;
        let extensions: Vec<String> = self.extensions.into_iter().collect();
        if !extensions.is_empty() {
            let text = match extensions.len() {
                1 => format!("the extension {} of materials", extensions[0]),
                _ => format!("the extensions {} of materials", listed(&extensions)),
            };
            materials.others.insert(text);
        }
        if self.textures.len() < self.look.textures.len() {
            materials
                .others
                .insert("textures that no material shows".to_owned());
        }
        let num_shown = self.images.len();
        match self.look.images.len().saturating_sub(num_shown) {
            0 => {}
            1 => {
                materials
                    .others
                    .insert("an image of other textures".to_owned());
            }
            n => {
                materials
                    .others
                    .insert(format!("{n} images of other textures"));
            }
        }
        materials
    }
}
