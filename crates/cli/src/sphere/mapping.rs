//! Maps a prepared mesh to the sphere in the requested scalar type.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use cotan::geometry::{Positions, Scalar, Surface};
use cotan::sphere::{
    SphereMap, SphereOptions, SphereQuality, SphereReport, Spherical, spherical_observed,
};
use cotan_tool::Work;
use nalgebra::Point3;

use super::landmarks;
use super::refusal::refuse;
use crate::console::Progress;
use crate::error::CliError;
use crate::prepare::Prepared;

/// The parameters of a mapping.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mapper<'a> {
    pub(crate) mesh: &'a Prepared,
    pub(crate) options: &'a SphereOptions,
    pub(crate) turn: Turn<'a>,
}

/// The rotation of the sphere after the mapping.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Turn<'a> {
    /// None.
    None,
    /// The principal axes of the mesh become those of the sphere.
    Principal,
    /// By three vertices named in a file.
    Landmarks(&'a Path),
}

/// A mesh and its map to the sphere.
#[derive(Clone, Debug)]
pub(crate) struct Mapped<T: Scalar> {
    /// The source positions, relative to `origin` and in multiples of `unit`.
    pub(crate) positions: Positions<T>,
    /// In single precision the centre of the source, so that a mesh far from the origin keeps its
    /// digits.
    pub(crate) origin: Point3<f64>,
    /// A power of two near the size of the source, so that areas neither overflow nor underflow
    /// and no digit changes.
    unit: f64,
    pub(crate) map: SphereMap<T>,
    pub(crate) report: SphereReport,
    /// The duration of the mapping.
    pub(crate) seconds: f64,
}

impl Mapper<'_> {
    /// Maps the mesh.
    ///
    /// # Errors
    /// [`CliError::Sphere`] for a mesh that cannot be mapped, with the indices of its file.
    pub(crate) fn run<T: Scalar>(&self, progress: &Progress) -> Result<Mapped<T>, CliError> {
        let refuse = |error| refuse(self.mesh, error);
        progress.phase("map");
        let clock = Instant::now();
        let processing = &self.mesh.processing;
        let mesh = processing.mesh();
        let surface = Surface::new(mesh, processing.positions()).map_err(|e| refuse(e.into()))?;
        let origin = match T::default_epsilon().as_f64() > f64::EPSILON {
            true => surface.bounding_box().center(),
            false => Point3::origin(),
        };
        let unit = power_of_two(processing.positions(), &origin);
        let positions = processing
            .positions()
            .map(|p| Point3::from(((p - origin) / unit).map(T::of_f64)));
        let max_memory = self.mesh.check_memory(Work::Sphere)?;
        let options = self.options.clone().max_memory(Some(max_memory));
        let mut number = 0;
        let done = spherical_observed(
            Surface::assume_checked(mesh, &positions),
            &options,
            |step| {
                // Counted over all rounds.
                number += 1;
                progress.step(number, step.change);
                ControlFlow::Continue(())
            },
        );
        let Spherical { map, report } = done.map_err(refuse)?;
        Ok(Mapped {
            map: self.turned(map, &positions)?,
            positions,
            origin,
            unit,
            report,
            seconds: clock.elapsed().as_secs_f64(),
        })
    }

    fn turned<T: Scalar>(
        &self,
        map: SphereMap<T>,
        positions: &Positions<T>,
    ) -> Result<SphereMap<T>, CliError> {
        let turned = match self.turn {
            Turn::None => Ok(map),
            Turn::Principal => map.orient_principal(positions),
            Turn::Landmarks(path) => map.orient_landmarks(landmarks::three(path, self.mesh)?),
        };
        turned.map_err(|error| refuse(self.mesh, error))
    }
}

impl<T: Scalar> Mapped<T> {
    /// The source surface.
    pub(crate) fn surface(&self) -> Surface<'_, T> {
        Surface::assume_checked(self.map.mesh(), &self.positions)
    }

    /// Measures the distortion of angles and areas by the map.
    pub(crate) fn quality(&self) -> SphereQuality {
        SphereQuality::measure(&self.surface(), &self.map)
    }

    /// Converts positions in the space of the source to the coordinates of the file.
    pub(crate) fn in_file(&self, positions: &Positions<T>) -> Positions<f64> {
        positions.map(|p| self.point_in_file(*p))
    }

    /// Converts a point in the space of the source to the coordinates of the file.
    pub(crate) fn point_in_file(&self, p: Point3<T>) -> Point3<f64> {
        self.origin + p.coords.map(T::as_f64) * self.unit
    }
}

/// The largest power of two that does not exceed the largest coordinate relative to `origin`.
///
/// Returns 1 if all coordinates are 0, and never a subnormal number.
fn power_of_two(positions: &Positions<f64>, origin: &Point3<f64>) -> f64 {
    let sizes = positions.values().map(|p| (p - origin).amax());
    let size = sizes.fold(0.0, f64::max);
    // Clear the bits of the fraction.
    let power = f64::from_bits(size.to_bits() & !((1 << (f64::MANTISSA_DIGITS - 1)) - 1));
    match size > 0.0 {
        true => power.max(f64::MIN_POSITIVE),
        false => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_is_a_power_of_two_at_most_twice_below_the_size() {
        for size in [1.0, 1.5, 3.0, 1e300, 1e-300, 0.1, f64::MAX] {
            let positions: Positions<f64> =
                [Point3::new(0.0, -size, 0.5 * size)].into_iter().collect();
            let unit = power_of_two(&positions, &Point3::origin());
            assert!(unit <= size && size / unit < 2.0, "{size:e}: {unit:e}");
            assert_eq!(unit.to_bits() & ((1 << 52) - 1), 0);
        }
        let none: Positions<f64> = [Point3::origin()].into_iter().collect();
        assert_eq!(power_of_two(&none, &Point3::origin()), 1.0);
    }
}
