//! Parsers for option values, run while the command line is read.

use std::num::NonZeroUsize;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use cotan::flow::{Acceleration, Schedule, Start};
use cotan::linear::Strategy;
use cotan::smooth::SmoothMethod;
use cotan::sphere::{Centering, SphereMethod};
use cotan::{OrientationKind, SchemeKind};
use cotan_io::{Filling, Weld};

/// The library's names of schemes.
pub(crate) fn scheme() -> impl TypedValueParser<Value = SchemeKind> {
    PossibleValuesParser::new(SchemeKind::ALL.iter().map(|kind| kind.name()))
        .try_map(|name| name.parse::<SchemeKind>())
}

/// The library's names of sphere methods.
pub(crate) fn sphere_method() -> impl TypedValueParser<Value = SphereMethod> {
    PossibleValuesParser::new(SphereMethod::ALL.iter().map(|method| method.name()))
        .try_map(|name| name.parse::<SphereMethod>())
}

/// `on` or `off`.
pub(crate) fn centering() -> impl TypedValueParser<Value = Centering> {
    PossibleValuesParser::new(Centering::ALL.iter().map(|centering| centering.name()))
        .try_map(|name| name.parse::<Centering>())
}

/// The library's names of orientations.
pub(crate) fn orientation() -> impl TypedValueParser<Value = OrientationKind> {
    PossibleValuesParser::new(OrientationKind::ALL.iter().map(|kind| kind.name()))
        .try_map(|name| name.parse::<OrientationKind>())
}

/// The library's names of strategies.
pub(crate) fn strategy() -> impl TypedValueParser<Value = Strategy> {
    PossibleValuesParser::new(Strategy::ALL.iter().map(|strategy| strategy.name())).map(|name| {
        let named = |strategy: &&Strategy| strategy.name() == name;
        Strategy::ALL
            .iter()
            .find(named)
            .copied()
            .unwrap_or_default()
    })
}

/// A number of bytes, with or without K, M or G (powers of 1000).
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let (number, unit) = match text.char_indices().last() {
        Some((end, 'K' | 'k')) => (&text[..end], 1_000),
        Some((end, 'M' | 'm')) => (&text[..end], 1_000_000),
        Some((end, 'G' | 'g')) => (&text[..end], 1_000_000_000),
        _ => (text, 1),
    };
    let number = number.parse::<u64>().ok().and_then(|n| n.checked_mul(unit));
    number.ok_or_else(|| "give a number of bytes, such as 500M or 4G".to_owned())
}

/// Like [`bytes`], for a length in memory.
pub(crate) fn length(text: &str) -> Result<usize, String> {
    bytes(text).map(|bytes| usize::try_from(bytes).unwrap_or(usize::MAX))
}

/// A number of threads.
pub(crate) fn threads(text: &str) -> Result<NonZeroUsize, String> {
    text.parse::<NonZeroUsize>()
        .ok()
        .filter(|threads| threads.get() <= MAX_THREADS)
        .ok_or_else(|| format!("give a number of threads from 1 to {MAX_THREADS}"))
}

/// More threads than any machine can use; each reserves some megabytes of address space.
const MAX_THREADS: usize = 1024;

/// The library's names of smoothing methods.
pub(crate) fn smooth_method() -> impl TypedValueParser<Value = SmoothMethod> {
    PossibleValuesParser::new(SmoothMethod::ALL.iter().map(|method| method.name()))
        .try_map(|name| name.parse::<SmoothMethod>())
}

pub(crate) fn schedule() -> impl TypedValueParser<Value = Schedule> {
    PossibleValuesParser::new(["full", "paper"]).map(|name| match name.as_str() {
        "paper" => Schedule::PAPER,
        _ => Schedule::FULL,
    })
}

pub(crate) fn start() -> impl TypedValueParser<Value = Start> {
    PossibleValuesParser::new(["rotations", "original", "zero"]).map(|name| match name.as_str() {
        "original" => Start::Original,
        "zero" => Start::Zero,
        _ => Start::HandleRotations,
    })
}

/// `off`, or the number of previous steps to remember.
pub(crate) fn acceleration(text: &str) -> Result<Acceleration, String> {
    match (text, text.parse::<usize>()) {
        ("off", _) | (_, Ok(0)) => Ok(Acceleration::Off),
        (_, Ok(memory)) if memory <= MAX_MEMORY => Ok(Acceleration::Memory(memory)),
        _ => Err(format!(
            "give a number of steps from 1 to {MAX_MEMORY}, or off"
        )),
    }
}

/// `off`, `exact`, or a distance.
pub(crate) fn weld(text: &str) -> Result<Weld, String> {
    match text {
        "off" => Ok(Weld::Off),
        "exact" => Ok(Weld::Exact),
        _ => tolerance(text)
            .map(Weld::Within)
            .map_err(|_| "give off, exact, or a distance of at least 0".to_owned()),
    }
}

/// Like [`weld`], for a repair that merges vertices.
pub(crate) fn merge(text: &str) -> Result<Weld, String> {
    weld(text)
        .ok()
        .filter(|weld| *weld != Weld::Off)
        .ok_or_else(|| "give exact, or a distance of at least 0".to_owned())
}

/// The filling of holes: the largest number of edges, `smooth`, or both as `smooth:N`.
pub(crate) fn filling(text: &str) -> Result<Filling, String> {
    let most = |text: &str| text.parse::<NonZeroUsize>().ok();
    let filling = match text.strip_prefix("smooth") {
        Some("") => Some(Filling::SMOOTH),
        Some(behind) => behind
            .strip_prefix(':')
            .and_then(most)
            .map(|max_edges| Filling::Smooth { max_edges }),
        None => most(text).map(|max_edges| Filling::Plain { max_edges }),
    };
    filling.ok_or_else(|| "give a number of edges from 1, smooth, or smooth:N".to_owned())
}

/// A tolerance: finite and at least 0.
pub(crate) fn tolerance(text: &str) -> Result<f64, String> {
    number(text)
        .filter(|x| *x >= 0.0)
        .ok_or_else(|| "give a number of at least 0".to_owned())
}

/// A share from 0 to 1.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    number(text)
        .filter(|x| (0.0..=1.0).contains(x))
        .ok_or_else(|| "give a number from 0 to 1".to_owned())
}

/// The number of subdivisions of an icosphere; each splits every face into four.
pub(crate) fn level() -> impl TypedValueParser<Value = u32> {
    clap::value_parser!(u32).range(0..=8)
}

/// The side of a geometry image: odd, so that the centre is a pixel.
pub(crate) fn odd_size(text: &str) -> Result<usize, String> {
    let size = text.parse::<usize>().ok();
    size.filter(|n| (3..=4097).contains(n) && n % 2 == 1)
        .ok_or_else(|| "give an odd number from 3 to 4097".to_owned())
}

/// A weight relative to that of the membrane.
pub(crate) fn weight(text: &str) -> Result<f64, String> {
    number(text)
        .filter(|x| (0.0..=1000.0).contains(x))
        .ok_or_else(|| "give a number between 0 and 1000".to_owned())
}

/// A length in the unit of the mesh, or a share of its longest side.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Length {
    Absolute(f64),
    Share(f64),
}

impl Length {
    /// The length on a mesh with this longest side.
    pub(crate) fn on(self, longest_side: f64) -> f64 {
        match self {
            Self::Absolute(length) => length,
            Self::Share(share) => share * longest_side,
        }
    }
}

/// A length of at least 0, or a share in per cent.
pub(crate) fn length_or_share(text: &str) -> Result<Length, String> {
    let (text, length): (_, fn(f64) -> Length) = match text.strip_suffix('%') {
        Some(percent) => (percent, |x| Length::Share(0.01 * x)),
        None => (text, Length::Absolute),
    };
    number(text.trim())
        .filter(|x| *x >= 0.0)
        .map(length)
        .ok_or_else(|| "give a length of at least 0, or a share such as 2%".to_owned())
}

/// A spring weight or a length: finite and above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    number(text)
        .filter(|x| *x > 0.0)
        .ok_or_else(|| "give a number above 0".to_owned())
}

/// Three coordinates, separated by commas.
pub(crate) fn point(text: &str) -> Result<[f64; 3], String> {
    let coordinates: Option<Vec<f64>> = text.split(',').map(|x| number(x.trim())).collect();
    coordinates
        .and_then(|x| <[f64; 3]>::try_from(x).ok())
        .ok_or_else(|| "give three numbers X,Y,Z".to_owned())
}

fn number(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|x| x.is_finite())
}

/// Each remembered step takes two vectors of the size of the mesh.
const MAX_MEMORY: usize = 100;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_one_of_the_mesh_or_a_share() {
        assert_eq!(length_or_share("0.5"), Ok(Length::Absolute(0.5)));
        assert_eq!(length_or_share("25%").map(|l| l.on(8.0)), Ok(2.0));
        for text in ["", "%", "-1", "nan", "2 percent", "inf%"] {
            assert!(length_or_share(text).is_err(), "{text}");
        }
    }

    #[test]
    fn acceleration_is_a_memory_or_off() {
        assert_eq!(acceleration("off"), Ok(Acceleration::Off));
        assert_eq!(acceleration("0"), Ok(Acceleration::Off));
        assert_eq!(acceleration("5"), Ok(Acceleration::Memory(5)));
        assert!(acceleration("many").is_err() && acceleration("-1").is_err());
        assert!(acceleration("1000000000").is_err());
    }

    #[test]
    fn bytes_have_a_unit_or_none() {
        assert_eq!(bytes("1024"), Ok(1024));
        assert_eq!(bytes("4G"), Ok(4_000_000_000));
        assert_eq!(bytes("500m"), Ok(500_000_000));
        for bad in ["", "G", "-1", "1.5G", "99999999999G", "4GB"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn welding_is_a_mode_or_a_distance() {
        assert_eq!(weld("off"), Ok(Weld::Off));
        assert_eq!(weld("1e-5"), Ok(Weld::Within(1e-5)));
        assert_eq!(merge("exact"), Ok(Weld::Exact));
        assert!(weld("-1").is_err() && weld("near").is_err() && merge("off").is_err());
    }

    #[test]
    fn numbers_are_finite_and_in_range() {
        assert_eq!(tolerance("0"), Ok(0.0));
        assert_eq!(positive("2.5"), Ok(2.5));
        for refused in ["-1", "NaN", "inf", "1e999", "x", ""] {
            assert!(tolerance(refused).is_err(), "{refused}");
            assert!(positive(refused).is_err(), "{refused}");
            assert!(share(refused).is_err(), "{refused}");
        }
        assert!(positive("0").is_err());
        assert_eq!((share("0"), share("1")), (Ok(0.0), Ok(1.0)));
        assert!(share("1.01").is_err());
    }
}
