use cotan::Mesh;
use cotan::geometry::triangle_on_ray;
use cotan::shapes::{bar, icosphere, torus};
use eframe::egui::{Rect, pos2, vec2};

use super::*;
use crate::view::camera::Camera;

const RECT: Rect = Rect {
    min: Pos2::new(0.0, 0.0),
    max: Pos2::new(800.0, 600.0),
};

fn shapes() -> Vec<Mesh<f64>> {
    vec![
        icosphere(3),
        torus(1.0, 0.4, 24, 12),
        bar([3.0, 1.0, 1.0], [6, 2, 2]),
    ]
}

fn camera_of(shape: &Mesh<f64>, zoom: f64) -> CameraSnapshot {
    let mut camera = Camera::new(&shape.surface().bounding_box());
    camera.zoom(zoom, pos2(430.0, 280.0), RECT);
    camera.at(RECT)
}

fn pointers() -> impl Iterator<Item = Pos2> {
    (0..200).map(|i| pos2((i * 137 % 800) as f32 + 0.37, (i * 71 % 600) as f32 + 0.61))
}

fn all_hits(shape: &Mesh<f64>, ray: &Ray) -> impl Iterator<Item = (f64, FaceId)> {
    shape.connectivity().faces().filter_map(move |f| {
        let corners = shape
            .connectivity()
            .triangle(f)
            .map(|v| shape.positions()[v]);
        triangle_on_ray(ray, corners).map(|d| (d, f))
    })
}

fn is_visible(shape: &Mesh<f64>, v: VertexId, camera: &CameraSnapshot) -> bool {
    camera
        .ray_to(shape.positions()[v])
        .is_some_and(|(ray, far)| {
            all_hits(shape, &ray).all(|(d, f)| {
                d > far * (1.0 - 1e-8) || shape.connectivity().triangle(f).contains(&v)
            })
        })
}

#[test]
fn the_first_of_all_triangles_is_hit() {
    for shape in shapes() {
        let picker = Picker::new(shape.connectivity(), shape.positions());
        for zoom in [0.1, 1.0, 8.0] {
            let camera = camera_of(&shape, zoom);
            for pos in pointers() {
                let ray = camera.ray(pos);
                let first = all_hits(&shape, &ray).min_by(|a, b| a.0.total_cmp(&b.0));
                let hit = picker.hit(&ray);
                assert_eq!(hit.map(|h| h.distance), first.map(|f| f.0));
                if let Some(hit) = hit {
                    assert!(camera.project(hit.point).unwrap().distance(pos) < 0.01);
                    assert!(
                        shape
                            .connectivity()
                            .triangle(hit.face)
                            .contains(&hit.vertex)
                    );
                }
            }
        }
    }
}

#[test]
fn a_vertex_is_visible_if_no_triangle_hides_it() {
    for shape in shapes() {
        let picker = Picker::new(shape.connectivity(), shape.positions());
        for zoom in [0.2, 1.0, 3.0] {
            let camera = camera_of(&shape, zoom);
            for v in shape.connectivity().vertices() {
                assert_eq!(
                    picker.visible(v, &camera),
                    is_visible(&shape, v, &camera),
                    "{v:?}"
                );
            }
        }
    }
}

#[test]
fn the_nearest_visible_vertex_is_picked() {
    for shape in shapes() {
        let picker = Picker::new(shape.connectivity(), shape.positions());
        // From several vertices per pixel to a triangle as large as the window.
        for (zoom, radius) in [(0.02, 8.0), (0.3, 8.0), (1.0, 12.0), (30.0, 12.0)] {
            let camera = camera_of(&shape, zoom);
            let middle = camera.project(camera.target()).unwrap();
            for pointer in pointers() {
                // Sample more densely where the shape is, which may be a dot.
                let pos = middle + (pointer - RECT.center()) * (zoom.min(1.0) as f32);
                let nearest = shape
                    .connectivity()
                    .vertices()
                    .filter_map(|v| Some((camera.project(shape.positions()[v])?.distance(pos), v)))
                    .filter(|(d, v)| *d <= radius && is_visible(&shape, *v, &camera))
                    .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let picked = picker.pick_vertex(&camera, pos, radius);
                match nearest {
                    Some((_, v)) => assert_eq!(picked, Some(v)),
                    None => {
                        let hit = picker.hit(&camera.ray(pos));
                        assert_eq!(picked.is_some(), hit.is_some());
                        if let (Some(v), Some(hit)) = (picked, hit) {
                            assert!(shape.connectivity().triangle(hit.face).contains(&v));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_refitted_picker_answers_as_a_new_one() {
    let shape = torus::<f64>(1.0, 0.4, 24, 12);
    let mut picker = Picker::new(shape.connectivity(), shape.positions());
    let bent = shape.positions().map(|p| {
        let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), p.x);
        turn * p * 3.0
    });
    picker.refit(&bent);
    let moved = shape.with_positions(bent).unwrap();
    let fresh = Picker::new(moved.connectivity(), moved.positions());
    let camera = camera_of(&moved, 1.0);
    for pos in pointers() {
        let ray = camera.ray(pos);
        let distance = |picker: &Picker| picker.hit(&ray).map(|h| h.distance);
        assert_eq!(distance(&picker), distance(&fresh));
    }
}

#[test]
fn rays_do_not_slip_through_edges_and_vertices() {
    let shape = icosphere::<f64>(3);
    let picker = Picker::new(shape.connectivity(), shape.positions());
    let camera = camera_of(&shape, 1.0);
    let mut shot = 0;
    for edge in shape.connectivity().edges() {
        let [a, b] = shape
            .connectivity()
            .edge_vertices(edge)
            .map(|v| shape.positions()[v]);
        for share in [0.0, 0.3, 0.5] {
            let Some((ray, distance)) = camera.ray_to(a + (b - a) * share) else {
                continue;
            };
            let hit = picker.hit(&ray);
            assert!(hit.is_some_and(|h| h.distance <= distance + 1e-9));
            shot += 1;
        }
    }
    assert!(shot > 1000);
}

#[test]
fn a_ray_along_an_axis_and_the_sides_of_boxes_hits() {
    let shape = icosphere::<f64>(3);
    let picker = Picker::new(shape.connectivity(), shape.positions());
    for axis in [
        nalgebra::Vector3::x(),
        nalgebra::Vector3::y(),
        nalgebra::Vector3::z(),
    ] {
        for direction in [axis, -axis] {
            let ray = Ray {
                origin: Point3::origin() - direction * 3.0,
                direction,
            };
            let hit = picker.hit(&ray);
            assert!(hit.is_some_and(|h| (h.distance - 2.0).abs() < 0.02));
        }
    }
}

#[test]
fn nothing_is_picked_beside_the_shape() {
    let shape = icosphere::<f64>(2);
    let picker = Picker::new(shape.connectivity(), shape.positions());
    let camera = camera_of(&shape, 1.0);
    let corner = RECT.min + vec2(2.0, 2.0);
    assert_eq!(picker.pick_vertex(&camera, corner, 10.0), None);
}
