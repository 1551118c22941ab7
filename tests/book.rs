//! The Rust examples of the book in `docs/book`, as doc tests.

macro_rules! chapters {
    ($($name:ident: $file:literal),+ $(,)?) => {
        $(
            #[doc = include_str!(concat!("../docs/book/src/", $file))]
            mod $name {}
        )+
    };
}

chapters! {
    first_edit: "first-edit.md",
    deform: "jobs/deform.md",
    parts: "jobs/parts.md",
    reconstruct: "jobs/reconstruct.md",
    smooth: "jobs/smooth.md",
    denoise: "jobs/denoise.md",
    detail: "jobs/detail.md",
    sphere: "jobs/sphere.md",
    merge: "jobs/merge.md",
    geodesic: "jobs/geodesic.md",
    remesh: "jobs/remesh.md",
    compare: "jobs/compare.md",
    repair: "jobs/repair.md",
    convert: "jobs/convert.md",
    info: "jobs/info.md",
    scheme: "extend/scheme.md",
    updater: "extend/updater.md",
    orientation: "extend/orientation.md",
    energy: "extend/energy.md",
    linear: "extend/linear.md",
    surfaces: "extend/surfaces.md",
    files: "files.md",
    performance: "performance.md",
    paper: "paper.md",
}
