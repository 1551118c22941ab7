//! Writing a document to a file, and the losses this incurs.

use std::path::PathBuf;

use super::Document;
use crate::companions::{Companions, References, WriteOptions, Written};
use crate::contents::Contents;
use crate::error::IoError;
use crate::format::Format;
use crate::formats;
use crate::material::Materials;
use crate::normals::Normals;
use crate::precision::Rounding;
use crate::source::{Moves, SourceFile};

impl Document {
    /// Lists what a write in `format` would drop or leave stale, one sentence each, for a
    /// warning.
    ///
    /// Empty if the written file preserves everything in the original.
    pub fn losses(&self, format: Format) -> Vec<String> {
        let source = self.source.as_ref();
        if let Some(source) = source.filter(|source| source.writes(format)) {
            if self.original.is_empty() {
                return Vec::new();
            }
            let mut stale = source.stale();
            if let Err(error) = self.turned_normals(source.as_ref()) {
                stale.push(format!("normals, which cannot be read ({error}),"));
            }
            let kept =
                |what: String| format!("{what} are not updated, although vertices have moved");
            let rounded = self.severe_rounding(source.as_ref());
            return stale.into_iter().map(kept).chain(rounded).collect();
        }
        let mut losses = self
            .origin()
            .map_or_else(Vec::new, |origin| origin.extras());
        match self.contents(format) {
            Ok(contents) => losses.extend(formats::losses(&contents, format)),
            Err(error) => return vec![format!("{format} cannot be written: {error}")],
        }
        let lost = |what: String| format!("{what} will be lost in {format}");
        losses.into_iter().map(lost).collect()
    }

    /// Describes the rounding of moved vertices to the number type of the file, if it affects
    /// more than the last digits.
    fn severe_rounding(&self, source: &dyn SourceFile) -> Option<String> {
        let stored = |v: usize| match self.original[v] == self.positions[v] {
            true => self.positions[v],
            false => source.stored(v, self.positions[v]),
        };
        let rounding = Rounding::measure(&self.positions, &self.faces, stored)?;
        rounding.is_severe().then(|| {
            format!(
                "the file has single precision, too little so far from its origin: {rounding}; \
                 write it as OBJ or OFF, or move the mesh to the origin first"
            )
        })
    }

    /// Writes the document in `format`.
    ///
    /// In the format that it was read from, only the coordinates of moved vertices and the
    /// normals rotated with the surface are replaced, in the number types of the file (a PLY with
    /// `float` coordinates keeps them as `float`). Otherwise a new file is written, with
    /// positions as exact as the format allows, the faces, and the attributes that it can
    /// represent. Text formats use the shortest number that reads back to the same bits.
    /// Unreadable normals are left as they are.
    ///
    /// Companion files must be placed next to the output; [`Document::write_with`] returns them.
    ///
    /// # Errors
    /// [`IoError::DoesNotFit`] if the number type of the format cannot represent a new
    /// coordinate; [`IoError`] with the location in the file if an attribute needed by another
    /// format is invalid.
    pub fn write(&self, format: Format) -> Result<Vec<u8>, IoError> {
        match &self.source {
            Some(source) if source.writes(format) => self.rewrite(source.as_ref(), format),
            _ => Ok(self.write_new(format, &WriteOptions::default())?.bytes),
        }
    }

    /// Like [`Document::write`], and also returns the companion files: those of the file that was
    /// read, and those created for a new one.
    ///
    /// # Errors
    /// As for [`Document::write`]; with [`Companions::Embedded`] also [`IoError::External`] for a
    /// file that cannot be read.
    pub fn write_with(
        &self,
        format: Format,
        options: &WriteOptions<'_>,
    ) -> Result<Written, IoError> {
        let Some(source) = self.source.as_ref().filter(|source| source.writes(format)) else {
            return self.write_new(format, options);
        };
        let mut bytes = self.rewrite(source.as_ref(), format)?;
        if options.companions == Companions::Embedded {
            bytes = source.embedded(bytes)?;
        }
        let References { companions, left } = source.references(&bytes)?;
        Ok(Written {
            bytes,
            companions,
            left,
        })
    }

    /// Lists the companion files of the file that this document was read from, by their paths in
    /// its folder: buffers, material libraries, and the images of both.
    ///
    /// Empty without a file.
    ///
    /// They are inputs just like the file itself: overwriting one of them changes the meaning of
    /// the file. They may be missing.
    ///
    /// # Errors
    /// [`IoError::External`] if a file cannot be looked up.
    pub fn companions(&self) -> Result<Vec<PathBuf>, IoError> {
        let Some(origin) = self.origin() else {
            return Ok(Vec::new());
        };
        let companions = origin.own_references()?.companions;
        Ok(companions.iter().map(|c| c.path().to_owned()).collect())
    }

    /// The contents of a new file in `format`.
    pub(crate) fn contents(&self, format: Format) -> Result<Contents<'_>, IoError> {
        let mesh = self.expanded()?;
        let materials = match format {
            Format::Obj if self.keeps_libraries() => Materials::default(),
            _ => self.materials_of(&mesh.attributes),
        };
        Ok(Contents::new(mesh, materials))
    }

    fn write_new(&self, format: Format, options: &WriteOptions<'_>) -> Result<Written, IoError> {
        let mut written = formats::write_new(&self.contents(format)?, format, options)?;
        let keeps_libraries = format == Format::Obj && self.keeps_libraries();
        if let Some(origin) = self.origin().filter(|_| keeps_libraries) {
            let References { companions, left } = origin.references(&written.bytes)?;
            written.companions.extend(companions);
            written.left.extend(left);
        }
        Ok(written)
    }

    /// The normals rotated where vertices have moved, or an error if the file's normals are
    /// invalid.
    fn turned_normals(&self, source: &dyn SourceFile) -> Result<Normals, IoError> {
        if self.original.is_empty() || self.original == self.positions || !source.has_normals() {
            return Ok(Normals::default());
        }
        let attributes = source.attributes(self.mesh())?;
        let (before, after) = (&self.original, &self.positions);
        Ok(Normals::turned(&attributes, &self.faces, before, after))
    }

    fn rewrite(&self, source: &dyn SourceFile, format: Format) -> Result<Vec<u8>, IoError> {
        self.with_moves(source, |moves| source.write(format, moves))
    }

    /// Passes on the replacements to make in the file.
    pub(super) fn with_moves<R>(
        &self,
        source: &dyn SourceFile,
        then: impl FnOnce(&Moves<'_>) -> R,
    ) -> R {
        let moved: Vec<bool> = self
            .original
            .iter()
            .zip(&self.positions)
            .map(|(before, after)| before != after)
            .collect();
        // Invalid normals must not prevent saving an edit.
        let normals = self.turned_normals(source).unwrap_or_default();
        then(&Moves {
            mesh: self.mesh(),
            moved: &moved,
            normals: &normals,
        })
    }
}
