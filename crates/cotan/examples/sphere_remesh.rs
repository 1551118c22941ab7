//! Applications of a sphere map: remeshing, morphing, writing a geometry image.
//!
//! Two shapes are pulled out of spheres, so the spheres themselves are their maps. For a mesh
//! from a file, the flow computes the map.
//!
//! `cargo run -p cotan --example sphere_remesh`

use cotan::prelude::*;
use cotan::sphere::{BitDepth, Morph, SphereMap};
use nalgebra::Rotation3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A sea urchin with 2562 vertices, and an egg whose map is tilted.
    let urchin = cotan::shapes::icosphere::<f64>(4);
    let urchin_map = SphereMap::new(urchin.connectivity(), urchin.positions().clone())?;
    let urchin_shape = urchin.positions().map(spike);
    let egg = cotan::shapes::icosphere::<f64>(3);
    let tilt = Rotation3::new(Vector3::new(0.4, -0.2, 0.9));
    let egg_map = SphereMap::new(egg.connectivity(), egg.positions().clone())?.rotated(&tilt)?;
    let egg_shape = egg
        .positions()
        .map(|p| Point3::new(p.x, p.y, 1.5 * p.z + 0.3 * p.z * p.z));

    println!("the urchin by icospheres, volume against the original's:");
    let original = urchin.surface().with_positions(&urchin_shape).volume();
    for level in 2..=6 {
        let remeshed = urchin_map.remesh(&urchin_shape, level)?;
        let share = remeshed.surface().volume() / original;
        println!(
            "  level {level}: {:6} vertices, {share:.5}",
            remeshed.num_vertices()
        );
    }

    // The egg upright, with its longest axis from pole to pole, like the urchin.
    let egg_map = egg_map.orient_principal(&egg_shape)?;
    let morph = Morph::on_icosphere((&urchin_map, &urchin_shape), (&egg_map, &egg_shape), 4)?;
    println!("from the urchin to the egg:");
    for t in [0.0, 0.25, 0.5, 0.75, 1.0] {
        println!(
            "  t = {t:.2}: volume {:.4}",
            morph.shape_at(t).surface().volume()
        );
    }

    let image = urchin_map.geometry_image(&urchin_shape, 65)?;
    let colours = image.encode(BitDepth::Sixteen);
    println!(
        "geometry image: {} x {} pixels, {} bytes, colours from {:.3} to {:.3}",
        image.width,
        image.height,
        colours.bytes.len(),
        colours.bounds.min,
        colours.bounds.max
    );

    let uvs = egg_map.longitude_latitude();
    let (table, _) = uvs.indexed(&egg_map);
    println!(
        "longitude and latitude of the egg: {} pairs for {} vertices, {} faces at the poles",
        table.len(),
        egg.num_vertices(),
        uvs.pole_faces.len()
    );
    Ok(())
}

/// Pulls the surface outwards along its radius around the six axes.
fn spike(p: &Point3<f64>) -> Point3<f64> {
    p * (1.0 + 0.8 * p.coords.amax().powi(24))
}
