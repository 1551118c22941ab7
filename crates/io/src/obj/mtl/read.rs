//! Conversion of MTL statements to materials.
//!
//! `Ns` is the exponent of the Phong highlight. Without `Pr`, roughness is 1 − √(Ns / 1000), as
//! in Blender, and without either it is 1. `d` takes precedence over `Tr`, and a `Tr` of 1 is
//! treated as opaque, as in MeshLab. A `map_d` with the same image as `map_Kd` means the alpha of
//! that image; any other one cannot be represented by the model.

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;

use super::files::{Libraries, Library, outside, reason};
use super::parse::Definition;
use crate::attributes::Labels;
use crate::error::quote;
use crate::limits::Limits;
use crate::material::{Alpha, Image, Material, Materials, listed, stem};
use crate::resolve::Resolve;

/// Reads the materials of an OBJ: those of the labels first, in their order, then the others.
pub(in crate::obj) fn materials(
    libraries: &Libraries,
    labels: Option<&Labels>,
    files: &dyn Resolve,
    limits: &Limits,
) -> Materials {
    let mut reader = Reader {
        files,
        budget: limits.max_bytes.min(limits.max_memory),
        materials: Materials::default(),
        places: BTreeMap::new(),
        missing: Vec::new(),
        statements: BTreeSet::new(),
    };
    let mut defined: BTreeMap<String, Option<Material>> = BTreeMap::new();
    let mut order = Vec::new();
    let mut doubled = BTreeSet::new();
    for library in &libraries.found {
        for definition in &library.definitions.materials {
            let material = reader.material(library, definition);
            let name = definition.name.clone();
            if defined.insert(name.clone(), Some(material)).is_some() {
                doubled.insert(format!("`{}`", quote(name.as_bytes())));
            } else {
                order.push(name);
            }
        }
    }
    let mut materials = reader.finish(libraries);
    if !doubled.is_empty() {
        let names: Vec<String> = doubled.into_iter().collect();
        let text = format!(
            "all materials but the last of the same name {}",
            listed(&names)
        );
        materials.others.insert(text);
    }
    if libraries.found.is_empty() {
        return materials;
    }
    for name in labels.map_or(&[][..], |labels| &labels.names) {
        let known = defined.get_mut(name).and_then(Option::take);
        materials
            .list
            .push(known.unwrap_or_else(|| Material::named(name)));
    }
    let unused = order
        .iter()
        .filter_map(|name| defined.get_mut(name)?.take());
    materials.list.extend(unused);
    materials.with_images_in_order()
}

/// The exponent equivalent to a roughness, for readers that do not know `Pr`.
pub(super) fn exponent(roughness: f32) -> f32 {
    1000.0 * (1.0 - roughness) * (1.0 - roughness)
}

fn roughness(exponent: f32) -> f32 {
    1.0 - (exponent.clamp(0.0, 1000.0) / 1000.0).sqrt()
}

struct Reader<'a> {
    files: &'a dyn Resolve,
    /// The number of image bytes that may still be read.
    budget: u64,
    materials: Materials,
    /// The image at each path that was looked up.
    places: BTreeMap<String, Option<usize>>,
    /// Missing images, with the reason.
    missing: Vec<String>,
    /// Statements that the model cannot represent.
    statements: BTreeSet<String>,
}

impl Reader<'_> {
    fn material(&mut self, library: &Library, definition: &Definition) -> Material {
        let mut material = Material::named(&definition.name);
        let number = |keyword: &str| definition.numbers.get(keyword).copied();
        let color = |keyword: &str| definition.colors.get(keyword).copied();
        let texture = |keyword: &str| definition.textures.get(keyword);
        let [base, emission, normal] = ["map_Kd", "map_Ke", "norm"]
            .map(|keyword| texture(keyword).and_then(|path| self.image(library, path)));
        material.base_color_texture = base;
        material.emission_texture = emission;
        material.normal_texture = normal;
        if let Some(color) = color("Kd") {
            material.base_color = color.map(|x| self.unit(x, "Kd"));
        }
        if let Some(color) = color("Ke") {
            material.emission = color.map(|x| if x < 0.0 { self.unit(x, "Ke") } else { x });
        } else if emission.is_some() {
            material.emission = [1.0; 3];
        }
        if let Some(metallic) = number("Pm") {
            material.metallic = self.unit(metallic, "Pm");
        }
        match (number("Pr"), number("Ns")) {
            (Some(own), exponent) => {
                material.roughness = self.unit(own, "Pr");
                let expected = self::exponent(material.roughness);
                if exponent.is_some_and(|x| (x - expected).abs() > 1e-3 * expected.max(1.0)) {
                    self.statements.insert("Ns".to_owned());
                }
            }
            (None, Some(exponent)) => material.roughness = roughness(exponent),
            (None, None) => {}
        }
        let transparency = number("Tr");
        if let Some(opacity) = number("d") {
            material.opacity = self.unit(opacity, "d");
        } else if transparency.is_some_and(|x| x >= 1.0) {
            // Some programs write the opacity here, and an invisible surface is never intended.
            self.statements.insert("Tr".to_owned());
        } else if let Some(transparency) = transparency {
            material.opacity = self.unit(1.0 - transparency, "Tr");
        }
        if material.opacity < 1.0 {
            material.alpha = Alpha::Blend;
        }
        if let Some(path) = texture("map_d") {
            let places = |path: &str| library.places(path);
            let is_same = |own: &String| !places(own).is_empty() && places(own) == places(path);
            if base.is_some() && texture("map_Kd").is_some_and(is_same) {
                material.alpha = Alpha::Blend;
            } else {
                self.statements.insert("map_d".to_owned());
            }
        }
        // Models 1 and 2 differ in the highlight, which the roughness already determines.
        if definition
            .model
            .is_some_and(|model| !matches!(model, 1 | 2))
        {
            self.statements.insert("illum".to_owned());
        }
        material
    }

    /// Clamps a number to the range 0 to 1, and records if it was outside.
    fn unit(&mut self, x: f32, keyword: &str) -> f32 {
        if !(0.0..=1.0).contains(&x) {
            let text = format!("numbers of materials beyond 0 to 1 ({keyword})");
            self.materials.others.insert(text);
        }
        x.clamp(0.0, 1.0)
    }

    /// The image that a library names, read on first use.
    fn image(&mut self, library: &Library, path: &str) -> Option<usize> {
        let places = library.places(path);
        let mut problem = outside();
        for place in &places {
            match self.places.get(place) {
                Some(Some(image)) => return Some(*image),
                Some(None) => return None,
                None => {}
            }
            match self.files.resolve(place, self.budget) {
                Ok(bytes) => return self.take(place, bytes),
                Err(error) => problem = error,
            }
        }
        for place in places {
            self.places.insert(place, None);
        }
        self.miss(path, &reason(&problem));
        None
    }

    /// Adds an image with these bytes.
    fn take(&mut self, place: &str, bytes: Vec<u8>) -> Option<usize> {
        let Some(rest) = self.budget.checked_sub(bytes.len() as u64) else {
            self.places.insert(place.to_owned(), None);
            self.miss(place, &reason(&ErrorKind::FileTooLarge.into()));
            return None;
        };
        let Some(image) = Image::new(stem(place), bytes) else {
            self.places.insert(place.to_owned(), None);
            self.miss(place, "it is neither a PNG nor a JPEG");
            return None;
        };
        self.budget = rest;
        self.materials.images.push(image);
        let index = self.materials.images.len() - 1;
        self.places.insert(place.to_owned(), Some(index));
        Some(index)
    }

    fn miss(&mut self, path: &str, problem: &str) {
        let text = format!("the image `{}` ({problem})", quote(path.as_bytes()));
        if !self.missing.contains(&text) {
            self.missing.push(text);
        }
    }

    /// The images, and everything that is not converted.
    fn finish(self, libraries: &Libraries) -> Materials {
        let mut materials = self.materials;
        let others = &mut materials.others;
        let mut statements = self.statements;
        let mut options = BTreeSet::new();
        for library in &libraries.found {
            let definitions = &library.definitions;
            statements.extend(definitions.statements.iter().cloned());
            options.extend(definitions.options.iter().map(|&option| option.to_owned()));
            if let Some((line, text)) = &definitions.first_wrong {
                let name = quote(library.name.as_bytes());
                others.insert(match definitions.num_wrong {
                    1 => format!("line {line} of `{name}`, which is wrong (`{text}`),"),
                    n => format!(
                        "{n} lines of `{name}` that are wrong, first line {line} (`{text}`),"
                    ),
                });
            }
        }
        let some = |words: BTreeSet<String>| {
            let words: Vec<String> = words.into_iter().collect();
            (!words.is_empty()).then(|| listed(&words))
        };
        others.extend(some(statements).map(|words| format!("the MTL statements {words}")));
        others.extend(some(options).map(|words| format!("the texture options {words}")));
        for (name, error) in &libraries.missing {
            let name = quote(name.as_bytes());
            others.insert(format!("the materials of `{name}` ({})", reason(error)));
        }
        if !self.missing.is_empty() {
            others.insert(listed(&self.missing));
        }
        materials
    }
}
