//! A new OBJ file with its material library and the images of its textures.

use std::sync::Arc;

use super::mtl;
use super::write::write;
use crate::companions::{Companion, WriteOptions, Written};
use crate::contents::Contents;
use crate::error::IoError;
use crate::material::{Materials, file_stem, unique_names};

/// Writes a new OBJ file with its companion files: `NAME.mtl`, and `NAME_IMAGE.png` or `.jpg` for
/// every image.
pub(crate) fn write_new(
    contents: &Contents<'_>,
    options: &WriteOptions<'_>,
) -> Result<Written, IoError> {
    let materials = &contents.materials;
    if materials.list.is_empty() {
        return Ok(Written::from(write(contents, None).into_bytes()));
    }
    // Some readers end a name at the first space.
    let name = file_stem(options.name);
    let library = format!("{name}.mtl");
    let images = image_files(materials, &name);
    let names = mtl::material_names(materials);
    let text = mtl::write(materials, &names, &images);
    let mut companions = vec![companion(&library, Arc::new(text.into_bytes()))?];
    for (image, file) in materials.images.iter().zip(&images) {
        companions.push(companion(file, image.shared_bytes())?);
    }
    Ok(Written {
        bytes: write(contents, Some(&library)).into_bytes(),
        companions,
        left: Vec::new(),
    })
}

/// The image file names, unique even if case is ignored.
fn image_files(materials: &Materials, name: &str) -> Vec<String> {
    let images = &materials.images;
    let stems: Vec<String> = images
        .iter()
        .map(|image| {
            let stem = file_stem(&image.name);
            // It may already be named after the mesh.
            let is_named = stem
                .strip_prefix(name)
                .is_some_and(|rest| rest.starts_with('_'));
            if is_named {
                stem
            } else {
                format!("{name}_{stem}")
            }
        })
        .collect();
    let stems = unique_names(stems.iter().map(String::as_str), name, |name| {
        Some(name.to_lowercase())
    });
    let files = stems.iter().zip(images);
    files
        .map(|(stem, image)| format!("{stem}.{}", image.kind().extension()))
        .collect()
}

fn companion(name: &str, bytes: Arc<Vec<u8>>) -> Result<Companion, IoError> {
    Companion::new(name, bytes).map_err(|problem| IoError::Companion {
        path: name.into(),
        problem: problem.to_owned(),
    })
}
