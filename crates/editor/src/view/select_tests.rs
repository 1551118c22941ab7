use cotan::Mesh;
use cotan::shapes::icosphere;
use eframe::egui::{pos2, vec2};
use nalgebra::{Point3, Vector3};

use super::*;
use crate::view::camera::{Camera, StandardView};

const RECT: Rect = Rect {
    min: Pos2::new(0.0, 0.0),
    max: Pos2::new(800.0, 600.0),
};

fn seen(shape: &Mesh<f64>, view: StandardView) -> (Picker, CameraSnapshot) {
    let mut camera = Camera::new(&shape.surface().bounding_box());
    camera.look_from(view);
    camera.jump();
    (
        Picker::new(shape.connectivity(), shape.positions()),
        camera.at(RECT),
    )
}

#[test]
fn a_brush_paints_what_it_covers_of_the_front() {
    let shape = icosphere::<f64>(4);
    let (picker, camera) = seen(&shape, StandardView::Front);
    for (pos, radius) in [(pos2(400.0, 300.0), 60.0), (pos2(500.0, 250.0), 25.0)] {
        let painted = brush(shape.connectivity(), &picker, &camera, pos, radius);
        let expected: Vec<VertexId> = shape
            .connectivity()
            .vertices()
            .filter(|v| {
                let place = camera.project(shape.positions()[*v]).unwrap();
                place.distance(pos) <= radius && shape.positions()[*v].z > 0.0
            })
            .collect();
        assert!(expected.len() > 5);
        assert_eq!(painted, expected);
    }
}

#[test]
fn a_brush_does_not_leap_over_a_gap() {
    // Two balls, the second behind the first and half covered by it.
    let ball = icosphere::<f64>(3);
    let num = ball.num_vertices();
    let shifted = |f: Vec<u32>| f.into_iter().map(|v| v + num as u32).collect();
    let behind = ball.connectivity().to_faces().into_iter().map(shifted);
    let faces: Vec<Vec<u32>> = ball
        .connectivity()
        .to_faces()
        .into_iter()
        .chain(behind)
        .collect();
    let back = ball
        .positions()
        .values()
        .map(|p| p + Vector3::new(1.2, 0.0, -3.0));
    let shape = Mesh::new(
        HalfedgeMesh::from_faces(2 * num, &faces).unwrap(),
        ball.positions().values().copied().chain(back).collect(),
    )
    .unwrap();
    let (picker, camera) = seen(&shape, StandardView::Front);
    let on_front = camera.project(Point3::new(0.6, 0.0, 0.8)).unwrap();
    let painted = brush(shape.connectivity(), &picker, &camera, on_front, 100.0);
    assert!(painted.len() > 20);
    assert!(painted.iter().all(|v| v.index() < num));
    // On the second ball, the part hidden by the first is left out.
    let on_back = camera.project(Point3::new(2.0, 0.0, -2.5)).unwrap();
    let painted = brush(shape.connectivity(), &picker, &camera, on_back, 100.0);
    assert!(painted.len() > 20);
    assert!(
        painted
            .iter()
            .all(|v| v.index() >= num && picker.visible(*v, &camera))
    );
}

#[test]
fn a_brush_beside_the_shape_paints_nothing() {
    let shape = icosphere::<f64>(3);
    let (picker, camera) = seen(&shape, StandardView::Front);
    let painted = brush(
        shape.connectivity(),
        &picker,
        &camera,
        pos2(5.0, 5.0),
        900.0,
    );
    assert_eq!(painted, []);
}

#[test]
fn a_lasso_around_all_takes_all_or_the_front() {
    let shape = icosphere::<f64>(3);
    let (picker, camera) = seen(&shape, StandardView::Right);
    let [min, max] = [RECT.min, RECT.max];
    let polygon = [min, pos2(max.x, min.y), max, pos2(min.x, max.y)];
    let through = lasso(&picker, &camera, &polygon, Reach::Through);
    assert_eq!(through, shape.connectivity().vertices().collect::<Vec<_>>());
    let visible = lasso(&picker, &camera, &polygon, Reach::Visible);
    // On a convex shape the visible vertices are those with a triangle that faces the eye.
    let normals = shape.surface().face_normals();
    let faces_eye = |v: &VertexId| {
        let to_eye = camera.eye() - shape.positions()[*v];
        let mut faces = shape.connectivity().vertex_faces(*v);
        faces.any(|f| normals[f].dot(&to_eye) > 0.0)
    };
    let expected: Vec<VertexId> = through.into_iter().filter(faces_eye).collect();
    assert_eq!(visible, expected);
}

#[test]
fn a_lasso_takes_what_it_winds_around() {
    // A pentagram, whose centre the even-odd rule would leave out.
    let star: Vec<Pos2> = (0..5)
        .map(|i| {
            let angle = f32::from(i as u8) * 0.8 * std::f32::consts::PI;
            pos2(100.0, 100.0) + vec2(angle.sin(), -angle.cos()) * 50.0
        })
        .collect();
    assert_ne!(winding(&star, pos2(100.0, 100.0)), 0);
    assert_ne!(winding(&star, pos2(100.0, 60.0)), 0);
    assert_eq!(winding(&star, pos2(70.0, 140.0 - 90.0)), 0);
    assert_eq!(winding(&[], pos2(0.0, 0.0)), 0);
}

#[test]
fn a_triangle_touches_a_disc_by_corner_side_or_inside() {
    let triangle = [vec2(10.0, 0.0), vec2(20.0, -30.0), vec2(20.0, 30.0)];
    assert!(touches(triangle, 10.5));
    assert!(!touches(triangle, 9.5));
    let around = [vec2(-90.0, -90.0), vec2(90.0, -90.0), vec2(0.0, 90.0)];
    assert!(touches(around, 1.0));
    let flat_side = [vec2(-90.0, 5.0), vec2(90.0, 5.0), vec2(0.0, 90.0)];
    assert!(touches(flat_side, 6.0));
    assert!(!touches(flat_side, 4.0));
}
