use std::f64::consts::FRAC_PI_4;

use eframe::egui::{Pos2, Rect, pos2, vec2};

use super::*;

const RECT: Rect = Rect {
    min: Pos2::new(40.0, 30.0),
    max: Pos2::new(840.0, 630.0),
};

/// Boxes of several sizes, around the origin and far from it.
fn scenes() -> Vec<BoundingBox<f64>> {
    let mut scenes = Vec::new();
    for size in [1e-3, 1.0, 1e6] {
        for center in [Point3::origin(), Point3::new(1e3, -2e3, 5e2) * (size * 1e3)] {
            let half = Vector3::new(0.5, 0.3, 0.4) * size;
            scenes.push(BoundingBox {
                min: center - half,
                max: center + half,
            });
        }
    }
    scenes
}

#[test]
fn a_ray_through_a_projected_point_meets_the_point() {
    for bounds in scenes() {
        let mut camera = Camera::new(&bounds);
        let anchor = bounds.min + bounds.extents() * 0.25;
        for _ in 0..30 {
            let snapshot = camera.at(RECT);
            let Some(pos) = camera.project(anchor, RECT) else {
                panic!("the anchor is always seen");
            };
            let ray = camera.ray(pos, RECT);
            let along = (anchor - ray.origin).dot(&ray.direction);
            assert!(along > 0.0);
            let miss = (ray.at(along) - anchor).norm() / snapshot.length_per_point(anchor);
            assert!(miss < 1e-3, "{miss} points beside it");
            let back = camera.unproject_at_depth_of(anchor, pos, RECT);
            assert!((back - anchor).norm() < 1e-3 * snapshot.length_per_point(anchor));
            camera.orbit(vec2(30.0, 7.0));
            camera.zoom_about(1.5, anchor);
        }
    }
}

#[test]
fn the_matrices_and_project_agree() {
    for bounds in scenes() {
        let camera = Camera::new(&bounds);
        let clip = camera.view_projection(RECT) * bounds.max.to_homogeneous();
        let place = clip.xyz() / clip.w;
        assert!(place.iter().all(|x| x.abs() <= 1.0), "{place}");
        let pos = camera.project(bounds.max, RECT).unwrap();
        let center = RECT.center();
        let by_matrix = pos2(
            center.x + 0.5 * RECT.width() * place.x as f32,
            center.y - 0.5 * RECT.height() * place.y as f32,
        );
        assert!(pos.distance(by_matrix) < 0.01);
    }
}

#[test]
fn zooming_keeps_what_is_under_the_pointer() {
    for bounds in scenes() {
        let mut camera = Camera::new(&bounds);
        let anchor = bounds.max;
        let start = camera.project(anchor, RECT).unwrap();
        for factor in [1.2, 3.0, 10.0, 20.0, 0.01, 0.1, 0.1] {
            camera.zoom_about(factor, anchor);
            let now = camera.project(anchor, RECT).unwrap();
            assert!(now.distance(start) < 0.01, "{now:?} {start:?}");
        }
    }
}

#[test]
fn all_that_fits_is_seen_and_lies_between_the_planes() {
    for bounds in scenes() {
        let mut camera = Camera::new(&bounds);
        for turn in 0..20 {
            camera.orbit(vec2(37.0, if turn < 10 { 20.0 } else { -40.0 }));
            camera.fit(&bounds);
            camera.jump();
            let snapshot = camera.at(RECT);
            for i in 0..8 {
                let side = |k: usize| [bounds.min[k], bounds.max[k]][i >> k & 1];
                let corner = Point3::new(side(0), side(1), side(2));
                let pos = snapshot.project(corner).unwrap();
                assert!(RECT.contains(pos));
                assert!(snapshot.depth(corner) < snapshot.lens().far);
            }
        }
    }
}

#[test]
fn panning_moves_the_target_with_the_pointer() {
    for bounds in scenes() {
        let mut camera = Camera::new(&bounds);
        let held = camera.target();
        camera.pan(vec2(31.0, -12.0), RECT);
        let pos = camera.project(held, RECT).unwrap();
        assert!(pos.distance(RECT.center() + vec2(31.0, -12.0)) < 0.01);
    }
}

#[test]
fn standard_views_look_along_the_axes() {
    let bounds = BoundingBox {
        min: Point3::new(-1.0, -1.0, -1.0),
        max: Point3::new(1.0, 1.0, 1.0),
    };
    let mut camera = Camera::new(&bounds);
    let mut forward = |up, view| {
        camera.set_up(up);
        camera.look_from(view);
        camera.jump();
        camera.at(RECT).forward()
    };
    let near = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-12;
    assert!(near(forward(UpAxis::Y, StandardView::Front), -Vector3::z()));
    assert!(near(forward(UpAxis::Y, StandardView::Right), -Vector3::x()));
    assert!(near(forward(UpAxis::Y, StandardView::Top), -Vector3::y()));
    assert!(near(forward(UpAxis::Z, StandardView::Front), Vector3::y()));
    assert!(near(forward(UpAxis::Z, StandardView::Right), -Vector3::x()));
    assert!(near(forward(UpAxis::Z, StandardView::Top), -Vector3::z()));
}

#[test]
fn an_animation_arrives_the_short_way() {
    let bounds = scenes()[0];
    let mut camera = Camera::new(&bounds);
    camera.look_from(StandardView::Left);
    camera.jump();
    camera.look_from(StandardView::Front);
    let mut most = 0.0_f64;
    let mut frames = 0;
    while camera.advance(1.0 / 60.0) {
        // The animation turns from a quarter turn left to the front, never past the right or the
        // back.
        let side = camera.eye() - camera.target();
        most = most.max((-side.z).atan2(-side.x).abs());
        frames += 1;
        assert!(frames < 120, "an animation ends");
    }
    assert!(most < 2.0 + FRAC_PI_4 / 4.0, "{most}");
    assert!((camera.at(RECT).forward() + Vector3::z()).norm() < 1e-3);
}

#[test]
fn what_is_behind_the_eye_has_no_place() {
    let camera = Camera::new(&scenes()[2]);
    let eye = camera.eye();
    assert_eq!(camera.project(eye + (eye - camera.target()), RECT), None);
    assert_eq!(camera.project(eye, RECT), None);
}

#[test]
fn a_gizmo_gets_the_same_matrices() {
    let camera = Camera::new(&scenes()[3]);
    let config = camera.gizmo_config(RECT, 1.5);
    let snapshot = camera.at(RECT);
    let [view, projection] = [snapshot.view(), snapshot.projection()];
    // Rows stay rows.
    assert_eq!(config.view_matrix.z.w, view[(2, 3)]);
    assert_eq!(config.view_matrix.x.y, view[(0, 1)]);
    assert_eq!(config.projection_matrix.z.w, projection[(2, 3)]);
    assert_eq!(config.projection_matrix.w.z, -1.0);
    assert_eq!(config.viewport, RECT);
}
