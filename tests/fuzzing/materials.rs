//! Material libraries: the mesh is read and written with their contents, whatever they are.

use std::io::{Error, ErrorKind};
use std::sync::Arc;

use cotan_io::{
    Document, Format, LabelKind, Limits, Materials, Resolve, WriteOptions, Written, read_with,
};

use super::files::limits;

/// A library under one name, and an image under every other name.
#[derive(Clone, Debug)]
struct Library(Arc<Vec<u8>>);

impl Resolve for Library {
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let bytes = match (uri, uri.len() % 3) {
            ("a.mtl", _) => self.0.to_vec(),
            (_, 0) => return Err(ErrorKind::NotFound.into()),
            (_, 1) => b"\xff\xd8\xff".to_vec(),
            _ => b"\x89PNG\r\n\x1a\n".to_vec(),
        };
        if bytes.len() as u64 > max_bytes {
            return Err(ErrorKind::FileTooLarge.into());
        }
        Ok(bytes)
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }
}

/// The files that were written next to a mesh.
#[derive(Clone, Debug)]
struct Beside(Arc<Written>);

impl Resolve for Beside {
    fn resolve(&self, uri: &str, _max_bytes: u64) -> Result<Vec<u8>, Error> {
        let mut companions = self.0.companions.iter();
        let found = companions.find(|companion| companion.path().to_str() == Some(uri));
        let found = found.ok_or_else(|| Error::from(ErrorKind::NotFound))?;
        found.bytes().map(|bytes| bytes.into_owned())
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }
}

/// Reads the bytes as the library of an OBJ, and checks the materials in all formats that support
/// them.
pub fn materials(data: &[u8]) {
    const MESH: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n\
        usemtl b\nf 1/1 3/3 2/2\nusemtl a\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nusemtl none\nf 3/1 1/2 4/3\n";
    let library = Library(Arc::new(data.to_vec()));
    let document = read_with(MESH, Some(Format::Obj), &limits(), &library)
        .unwrap_or_else(|error| panic!("{error}"));
    let found = known(&document);
    for format in Format::ALL {
        document.losses(format);
    }
    for format in [Format::Gltf, Format::Glb] {
        let again = through(&document, format);
        let written = known(&again);
        // The file names the materials even if nothing else is known about them.
        if !found.list.is_empty() {
            assert_eq!(written.images, found.images, "{format}");
            assert_eq!(written.list.len(), found.list.len());
            for (mut written, found) in written.list.iter().cloned().zip(&found.list) {
                // A component much darker than the brightest may become zero.
                let most = found.emission.into_iter().fold(0.0, f32::max);
                let both = written.emission.iter().zip(found.emission);
                assert!(both.into_iter().all(|(a, b)| (a - b).abs() <= most * 1e-30));
                written.emission = found.emission;
                assert_eq!(written, *found, "{format}");
            }
        }
        let back = known(&through(&again, Format::Obj));
        assert_eq!(back.list.len(), written.list.len());
        for (back, written) in back.list.iter().zip(&written.list) {
            assert_eq!(back.base_color, written.base_color);
            assert_eq!(back.opacity, written.opacity);
            assert_eq!(back.textures().count(), written.textures().count());
        }
    }
}

/// Returns the materials, checked against the labels and their own images.
fn known(document: &Document) -> Materials {
    let materials = document
        .materials()
        .unwrap_or_else(|error| panic!("{error}"));
    let attributes = document
        .attributes()
        .unwrap_or_else(|error| panic!("{error}"));
    let labels = attributes.label(LabelKind::Material);
    let names = labels.map_or(&[][..], |labels| &labels.names);
    if !materials.list.is_empty() {
        for (material, name) in materials.list.iter().zip(names) {
            assert_eq!(material.name, *name);
        }
        assert!(materials.list.len() >= names.len());
    }
    let made = document.clone().with_materials(materials.clone());
    made.unwrap_or_else(|error| panic!("{error}"));
    materials
}

fn through(document: &Document, format: Format) -> Document {
    let written = document.write_with(format, &WriteOptions::default());
    let written = Arc::new(written.unwrap_or_else(|error| panic!("{format}: {error}")));
    let bytes = written.bytes.clone();
    read_with(bytes, Some(format), &Limits::default(), &Beside(written))
        .unwrap_or_else(|error| panic!("{format}: {error}"))
}
