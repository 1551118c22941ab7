//! Handles: groups that are edited, several active ones, numbers, and the mirror.

use nalgebra::{Matrix3, Matrix4, Point3};

use super::*;
use crate::mirror::Mirror;
use crate::transform::Transform;

fn by(transform: Transform) -> Command {
    Command::Transform {
        transform,
        pivot: None,
    }
}

fn select(vertices: impl IntoIterator<Item = VertexId>) -> Command {
    Command::Select {
        vertices: vertices.into_iter().collect(),
        how: Combine::Replace,
    }
}

/// The vertices of the bar whose position has a property.
fn vertices(workspace: &Workspace, is_one: impl Fn(&Point3<f64>) -> bool) -> Vec<VertexId> {
    let original = workspace.model().unwrap().original();
    let found = original.iter().filter(|(_, p)| is_one(p));
    found.map(|(v, _)| v).collect()
}

fn hold(workspace: &mut Workspace, role: Role, is_one: impl Fn(&Point3<f64>) -> bool) {
    let found = vertices(workspace, is_one);
    run(workspace, [select(found), Command::MakeHandle { role }]);
}

#[test]
fn numbers_move_turn_and_scale_the_active_handle() {
    let place = Place::new();
    let mut workspace = place.open();
    let effects = workspace.apply(by(Transform::Move(Vector3::x())));
    assert!(matches!(effects.as_slice(), [Effect::Mentioned(text)] if text.contains("active")));
    hold_ends(&mut workspace);
    run(&mut workspace, [by(Transform::Move(Vector3::z() * 0.25))]);
    let now = scene(&workspace);
    let expected = Matrix4::new_translation(&(Vector3::z() * 0.25));
    assert_eq!(now.handles()[1].matrix, expected);
    assert_eq!(label(&workspace), "Move A");
    // More than a whole turn, in one go and in two.
    let turn = |degrees: f64| by(Transform::Turn(Vector3::x() * degrees));
    run(&mut workspace, [turn(400.0)]);
    let wound = scene(&workspace);
    let stated = wound.handles()[1].stated_turn().unwrap();
    assert!(
        (stated - Vector3::x() * 400_f64.to_radians()).norm() < 1e-9,
        "{stated}"
    );
    run(&mut workspace, [turn(-300.0), turn(500.0)]);
    let stated = scene(&workspace).handles()[1].turn;
    assert!(
        (stated - Vector3::x() * 600_f64.to_radians()).norm() < 1e-9,
        "{stated}"
    );
    run(&mut workspace, [Command::Undo, Command::Undo]);
    assert_eq!(scene(&workspace), wound);
    // About the middle of the handle, or about a vertex that was chosen as the pivot.
    let corner = vertices(&workspace, |p| p.x > 1.99 && p.y > 0.49 && p.z > 0.49)[0];
    let vertex = Some(corner);
    let scale = by(Transform::Scale {
        axes: Matrix3::identity(),
        factors: Vector3::new(1.0, 2.0, 2.0),
    });
    let center = wound.handles()[1].center(&wound.rest);
    run(&mut workspace, [scale.clone()]);
    let now = scene(&workspace);
    assert!((now.handles()[1].center(&now.rest) - center).norm() < 1e-9);
    run(
        &mut workspace,
        [Command::Undo, Command::SetPivot { vertex }],
    );
    let at = scene(&workspace).shape[corner];
    run(&mut workspace, [scale]);
    assert!((scene(&workspace).shape[corner] - at).norm() < 1e-9);
    assert!(scene(&workspace).handles()[1].matrix != wound.handles()[1].matrix);
}

#[test]
fn numbers_typed_during_a_drag_replace_each_other() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    let before = scene(&workspace);
    workspace.apply(Command::Grab { handle: 1 });
    for degrees in [4.0, 45.0, 450.0] {
        workspace.apply(Command::DragBy {
            transform: Transform::Turn(Vector3::x() * degrees),
            pivot: None,
        });
        workspace.finish();
    }
    workspace.apply(Command::Drop);
    workspace.finish();
    let turn = scene(&workspace).handles()[1].turn;
    assert!((turn - Vector3::x() * 450_f64.to_radians()).norm() < 1e-9);
    run(&mut workspace, [Command::Undo]);
    assert_eq!(scene(&workspace), before);
}

#[test]
fn several_active_handles_move_together_as_one_step() {
    let place = Place::new();
    let mut workspace = place.open();
    hold(&mut workspace, Role::Fixed, |p| p.x < -1.99);
    hold(&mut workspace, Role::Movable, |p| p.x.abs() < 0.01);
    hold(&mut workspace, Role::Movable, |p| p.x > 1.99);
    run(&mut workspace, [Command::ActivateToo { handle: 1 }]);
    assert!((workspace.model().unwrap().pivot().x - 1.0).abs() < 1e-9);
    let steps = workspace.model().unwrap().history().index();
    run(&mut workspace, [by(Transform::Move(Vector3::y() * 0.5))]);
    assert_eq!(workspace.model().unwrap().history().index(), steps + 1);
    assert_eq!(label(&workspace), "Move B, A");
    let expected = Matrix4::new_translation(&(Vector3::y() * 0.5));
    let now = scene(&workspace);
    assert!(now.handles()[1..].iter().all(|g| g.matrix == expected));
    // Off again, and a drag moves only the one that is left.
    run(&mut workspace, [Command::ActivateToo { handle: 2 }]);
    run(&mut workspace, [by(Transform::Move(Vector3::y() * 0.5))]);
    let now = scene(&workspace);
    assert_eq!(now.handles()[2].matrix, expected);
    assert!((now.handles()[1].matrix[(1, 3)] - 1.0).abs() < 1e-12);
}

#[test]
fn a_group_gains_and_loses_vertices_where_they_are() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    run(&mut workspace, [lift(0.4)]);
    let shape = scene(&workspace).shape;
    let more = vertices(&workspace, |p| p.x > 1.6 && p.x < 1.99);
    let whole = Command::AddToHandle { handle: 1 };
    run(&mut workspace, [select(more.clone()), whole]);
    let now = scene(&workspace);
    assert!(now.selection().is_empty());
    for v in &more {
        assert!(now.handles()[1].vertices.contains(v));
        assert!(
            (now.shape[*v] - shape[*v]).norm() < 1e-9,
            "a held vertex moves"
        );
    }
    run(
        &mut workspace,
        [select(more), Command::TakeFromHandle { handle: 1 }],
    );
    let end = vertices(&workspace, |p| p.x > 1.99);
    assert_eq!(scene(&workspace).handles()[1].vertices, end);
    // Taking the last one removes the group, and what was active is nothing.
    run(
        &mut workspace,
        [select(end), Command::TakeFromHandle { handle: 1 }],
    );
    assert_eq!(scene(&workspace).handles().len(), 1);
    assert_eq!(scene(&workspace).props.active, None);
}

#[test]
fn the_mirror_finds_the_other_side_of_selections_and_handles() {
    let place = Place::new();
    let mut workspace = place.open();
    let effects = workspace.apply(Command::MirrorSelection);
    assert!(matches!(effects.as_slice(), [Effect::Mentioned(text)] if text.contains("mirror")));
    run(&mut workspace, [Command::FindMirror]);
    let mirror = scene(&workspace).props.mirror.unwrap();
    assert!(mirror.normal.x.abs() > 0.999, "{mirror:?}");
    let right = vertices(&workspace, |p| p.x > 1.99 && p.y > 0.49);
    let left = vertices(&workspace, |p| p.x < -1.99 && p.y > 0.49);
    run(&mut workspace, [select(right.clone())]);
    assert_eq!(scene(&workspace).selection().len(), 2 * right.len());
    let role = Role::Movable;
    run(&mut workspace, [Command::MakeHandle { role }]);
    let now = scene(&workspace);
    let [a, b] = now.handles() else {
        panic!("{:?}", now.handles());
    };
    assert_eq!((&a.vertices, &b.vertices), (&right, &left));
    hold(&mut workspace, Role::Fixed, |p| p.x.abs() < 0.01);
    // One is dragged, and the other one goes its mirrored way.
    run(&mut workspace, [Command::Activate { handle: Some(0) }]);
    run(
        &mut workspace,
        [by(Transform::Move(Vector3::new(0.25, 0.5, 0.0)))],
    );
    run(&mut workspace, [by(Transform::Turn(Vector3::z() * 200.0))]);
    let now = scene(&workspace);
    let [a, b] = &now.handles()[..2] else {
        panic!("{:?}", now.handles());
    };
    for (v, w) in right
        .iter()
        .zip(vertices(&workspace, |p| p.x < -1.99 && p.y > 0.49))
    {
        let mut image = now.shape[*v];
        image.x = -image.x;
        let at_w = now.shape[w];
        let nearest = left.iter().map(|w| (now.shape[*w] - image).norm());
        assert!(nearest.fold(f64::MAX, f64::min) < 1e-9, "{image} {at_w}");
    }
    assert!(
        (a.turn + b.turn).norm() < 1e-9 && a.turn.norm() > 3.4,
        "{} {}",
        a.turn,
        b.turn
    );
    // Switched off, a drag moves one alone, and a project keeps the plane.
    let on = Some(mirror);
    let path = place.path("mirrored.cotan");
    let over = Over::Own;
    let save = Command::SaveAs {
        path: path.clone(),
        over,
    };
    run(&mut workspace, [save, Command::SetMirror { mirror: None }]);
    let matrix = b.matrix;
    run(&mut workspace, [by(Transform::Move(Vector3::y() * 0.1))]);
    assert_eq!(scene(&workspace).handles()[1].matrix, matrix);
    let mut read = open(&path);
    assert_eq!(scene(&read).props.mirror, on);
    run(&mut read, [by(Transform::Move(Vector3::y() * 0.1))]);
    assert_ne!(scene(&read).handles()[1].matrix, matrix);
    let normal = Vector3::zeros();
    let none = Mirror { normal, ..mirror };
    let refused = read.apply(Command::SetMirror { mirror: Some(none) });
    assert!(matches!(refused.as_slice(), [Effect::Mentioned(_)]));
}
