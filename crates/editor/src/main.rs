//! The program `cotan-editor`.

fn main() {}
