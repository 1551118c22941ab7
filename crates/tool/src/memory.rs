//! The memory limit of a program, and predictions of the memory that its work takes.
//!
//! Work that does not fit is rejected before it begins. Memory that depends only on the size of
//! the mesh is predicted here. Memory that depends on its pattern (factors, products of matrices)
//! is left to [`cotan::linear`], which is given the remaining amount.

use cotan::flow::Hybrid;
use cotan_io::{Document, Limits};
use thiserror::Error;

/// The maximum memory of a program, in bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MemoryLimit {
    bytes: u64,
}

/// The required memory exceeds the limit, or is not available.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// The prediction exceeds the limit.
    #[error(
        "{work} this mesh is predicted to take {} of memory, but only {} are allowed; raise the limit (--max-memory), or simplify the mesh",
        megabytes(*predicted), megabytes(*permitted)
    )]
    OverLimit {
        /// The work to be done.
        work: Work,
        /// Predicted memory in bytes.
        predicted: u64,
        /// The limit in bytes.
        permitted: u64,
    },
    /// The system cannot provide the predicted memory.
    #[error(
        "{work} this mesh is predicted to take {} of memory, which the system cannot provide; simplify the mesh",
        megabytes(*predicted)
    )]
    OutOfMemory {
        /// The work to be done.
        work: Work,
        /// Predicted memory in bytes.
        predicted: u64,
    },
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB ({bytes} bytes)", bytes as f64 / 1e6)
}

/// An operation of a program on a mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Work {
    /// Writes it in another format.
    Convert,
    /// Builds a surface and measures it.
    Build,
    /// Looks for defects.
    Inspect,
    /// Repairs it.
    Repair,
    /// Moves handles, without the factors.
    Deform,
    /// Smooths it or edits its details, without the factors.
    Smooth,
    /// Maps it to the sphere, without the factors.
    Sphere,
    /// Measures distances along it, without the factors.
    Distances,
    /// Measures the distance between it and another mesh of this size.
    Compare,
    /// Measures the speed of editing.
    Bench,
}

impl std::fmt::Display for Work {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Convert => "converting",
            Self::Build => "building",
            Self::Inspect => "inspecting",
            Self::Repair => "repairing",
            Self::Deform => "deforming",
            Self::Smooth => "smoothing",
            Self::Sphere => "mapping",
            Self::Distances | Self::Compare | Self::Bench => "measuring",
        })
    }
}

impl Work {
    /// Bytes per vertex and per triangle, including the document itself: at least a quarter above
    /// the values measured on closed meshes with 41,000 and 164,000 vertices. Struts and the
    /// columns of point handles, which predict their own, are not included.
    const fn bytes(self) -> [u64; 2] {
        match self {
            Self::Convert => [500, 400],
            Self::Build => [300, 300],
            Self::Inspect => [500, 500],
            Self::Repair => [500, 450],
            Self::Deform => [1_000, 600],
            Self::Smooth => [1_000, 600],
            Self::Sphere => [1_000, 600],
            Self::Distances => [1_000, 800],
            Self::Compare => [800, 1_200],
            Self::Bench => [3_000, 3_000],
        }
    }

    /// Predicts the memory of the work in bytes, including the document and the program itself.
    pub fn predict(self, document: &Document) -> u64 {
        let faces = document.faces();
        let triangles = faces.num_corners().saturating_sub(2 * faces.len()) as u64;
        let vertices = document.positions().len() as u64;
        let [per_vertex, per_triangle] = self.bytes();
        // The bytes of the file are kept, and a writer creates as many.
        let file = document.num_bytes() as u64;
        let struts = match self {
            Self::Deform | Self::Bench => Hybrid::predicted_strut_bytes(
                document.positions().len(),
                usize::try_from(triangles).unwrap_or(usize::MAX),
            ),
            _ => 0,
        };
        PROGRAM
            .saturating_add(struts)
            .saturating_add(vertices.saturating_mul(per_vertex))
            .saturating_add(triangles.saturating_mul(per_triangle))
            .saturating_add(file.saturating_mul(2))
    }
}

/// Memory of the program itself, in bytes.
const PROGRAM: u64 = 10_000_000;

impl MemoryLimit {
    /// Creates a limit of this many bytes.
    pub const fn new(bytes: u64) -> Self {
        Self { bytes }
    }

    /// Four fifths of the available memory: that of the machine, of its control group, or of the
    /// process's remaining address space, whichever is smallest.
    pub fn of_machine() -> Self {
        let memory = physical_memory().map_or(u64::MAX, four_fifths);
        Self::new(memory).within_address_space()
    }

    /// Limits this to four fifths of the process's remaining address space.
    ///
    /// To be called when all threads have started, since their stacks and heaps use address
    /// space.
    #[must_use]
    pub fn within_address_space(self) -> Self {
        let left = free_addresses().map_or(u64::MAX, four_fifths);
        Self::new(self.bytes.min(left))
    }

    /// The limit in bytes.
    pub const fn bytes(self) -> u64 {
        self.bytes
    }

    /// Reduces limits of reading to this amount of memory.
    #[must_use]
    pub fn reading(self, limits: Limits) -> Limits {
        Limits {
            max_memory: limits.max_memory.min(self.bytes),
            ..limits
        }
    }

    /// Checks that the work fits, and returns the number of bytes left for factors.
    ///
    /// # Errors
    /// [`MemoryError`] if it does not fit, or if the system cannot provide the memory.
    pub fn check(self, work: Work, document: &Document) -> Result<u64, MemoryError> {
        let predicted = work.predict(document);
        if predicted > self.bytes {
            return Err(MemoryError::OverLimit {
                work,
                predicted,
                permitted: self.bytes,
            });
        }
        let more = predicted.saturating_sub(PROGRAM + document.num_bytes() as u64);
        let more = usize::try_from(more).unwrap_or(usize::MAX);
        // Nothing is written to it, so only address space is used.
        Vec::<u8>::new()
            .try_reserve_exact(more)
            .map_err(|_| MemoryError::OutOfMemory { work, predicted })?;
        Ok(self.bytes - predicted)
    }
}

/// The memory of the machine, or of the control group if that is less.
fn physical_memory() -> Option<u64> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let machine = Some(system.total_memory()).filter(|&bytes| bytes > 0)?;
    let group = system.cgroup_limits().map(|group| group.total_memory);
    Some(group.map_or(machine, |group| group.min(machine)))
}

fn four_fifths(bytes: u64) -> u64 {
    bytes / 5 * 4
}

/// The remaining address space, if it is limited.
#[cfg(unix)]
fn free_addresses() -> Option<u64> {
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current?;
    Some(limit.saturating_sub(taken_addresses().unwrap_or(PROGRAM)))
}

#[cfg(not(unix))]
fn free_addresses() -> Option<u64> {
    None
}

/// The address space used by the process.
#[cfg(unix)]
fn taken_addresses() -> Option<u64> {
    use sysinfo::{ProcessRefreshKind, ProcessesToUpdate};
    let pid = sysinfo::get_current_pid().ok()?;
    let mut system = sysinfo::System::new();
    let kind = ProcessRefreshKind::nothing().with_memory();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[pid]), false, kind);
    Some(system.process(pid)?.virtual_memory())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        let shape = cotan::shapes::icosphere::<f64>(3);
        Document::from_mesh(shape.connectivity(), shape.positions()).unwrap()
    }

    #[test]
    fn the_memory_of_the_machine_is_plausible() {
        let bytes = MemoryLimit::of_machine().bytes();
        assert!((64 << 20..u64::MAX / 2).contains(&bytes), "{bytes}");
    }

    #[test]
    fn work_that_fits_leaves_the_rest_and_other_work_is_refused_with_its_bytes() {
        let document = document();
        for work in [Work::Convert, Work::Build, Work::Inspect, Work::Deform] {
            let predicted = work.predict(&document);
            assert_eq!(
                MemoryLimit::new(predicted + 7).check(work, &document),
                Ok(7)
            );
            let refused = MemoryLimit::new(predicted - 1).check(work, &document);
            let text = refused.unwrap_err().to_string();
            assert!(text.contains(&format!("{predicted} bytes")), "{text}");
        }
    }

    #[test]
    fn reading_is_bounded_by_the_limit_and_by_its_own() {
        let limit = MemoryLimit::new(1_000);
        assert_eq!(limit.reading(Limits::default()).max_memory, 1_000);
        let own = Limits {
            max_memory: 10,
            ..Limits::default()
        };
        assert_eq!(limit.reading(own).max_memory, 10);
    }
}
