//! The brush that paints the curvature field.

use cotan::smooth::{curvature_field, mean_curvature_rms};

use super::*;
use crate::brush::{Brush, Paint};
use crate::mirror::Mirror;

/// A bumpy sheet of 4 × 4 with a vertex every 1/8.
fn sheet(folder: &Path) -> Workspace {
    let path = folder.join("sheet.obj");
    let sheet = cotan::shapes::bumpy_plane::<f64>([4.0, 4.0], [32, 32], 0.1);
    let document = Document::from_mesh(sheet.connectivity(), sheet.positions()).unwrap();
    cotan_io::save(&document, &path).unwrap();
    open(&path)
}

fn brush(paint: Paint) -> Command {
    Command::SetBrush {
        brush: Brush {
            paint,
            radius: 0.2,
            ..Brush::default()
        },
    }
}

/// The vertex next to a point.
fn at(workspace: &Workspace, x: f64, y: f64) -> VertexId {
    let original = workspace.model().unwrap().original();
    let away = |p: &nalgebra::Point3<f64>| (p.x - x).hypot(p.y - y);
    let nearest = original
        .iter()
        .min_by(|a, b| away(a.1).total_cmp(&away(b.1)));
    nearest.unwrap().0
}

fn curved(workspace: &Workspace) -> f64 {
    let model = workspace.model().unwrap();
    mean_curvature_rms(&model.surface(&model.scene().shape))
}

#[test]
fn strokes_change_the_curvature_under_the_brush_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = sheet(folder.path());
    let original = scene(&workspace).shape;
    let middle = at(&workspace, 0.0, 0.0);
    let before = curved(&workspace);
    for (paint, is_more) in [
        (Paint::Detail(1.5), true),
        (Paint::Detail(0.5), false),
        (Paint::Smooth(0.2), false),
        (Paint::Flatten, false),
    ] {
        let stroke = vec![middle];
        run(&mut workspace, [brush(paint), Command::Paint { stroke }]);
        assert!(label(&workspace).starts_with("Brush: "));
        let now = curved(&workspace);
        assert_eq!(now > before, is_more, "{paint:?}: {before} {now}");
        let shape = scene(&workspace).shape;
        for (v, p) in original.iter() {
            // The surface is longer than its shadow.
            let is_far = (p - original[middle]).norm() > 0.8;
            assert!(!is_far || shape[v] == *p, "{paint:?}");
        }
        run(&mut workspace, [Command::Undo]);
        assert_eq!(scene(&workspace).shape, original);
    }
    // Nothing is painted by a stroke beside the surface.
    run(&mut workspace, [Command::Paint { stroke: Vec::new() }]);
    assert_eq!(scene(&workspace).shape, original);
    let stroke = vec![VertexId::new(99_999)];
    let refused = workspace.apply(Command::Paint { stroke });
    assert!(matches!(refused.as_slice(), [Effect::Mentioned(_)]));
}

#[test]
fn inflating_raises_the_curvature_where_it_is_painted() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = sheet(folder.path());
    let middle = at(&workspace, 0.0, 0.0);
    let curvature = |workspace: &Workspace| {
        let model = workspace.model().unwrap();
        let field = curvature_field(&model.surface(&model.scene().shape));
        field[middle]
    };
    let before = curvature(&workspace);
    let stroke = vec![middle];
    let paint = Command::Paint { stroke };
    run(&mut workspace, [brush(Paint::Inflate(4.0)), paint.clone()]);
    let more = curvature(&workspace);
    run(
        &mut workspace,
        [Command::Undo, brush(Paint::Inflate(-4.0)), paint],
    );
    let less = curvature(&workspace);
    assert!(less < before && before < more, "{less} {before} {more}");
}

#[test]
fn fixed_regions_masks_and_the_mirror_hold_for_the_brush() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = sheet(folder.path());
    let original = scene(&workspace).shape;
    let middle = at(&workspace, 0.0, 0.0);
    let select = Command::Select {
        vertices: vec![middle],
        how: Combine::Replace,
    };
    let fix = Command::MakeHandle { role: Role::Fixed };
    let stroke = vec![middle];
    let paint = Command::Paint { stroke };
    run(
        &mut workspace,
        [select, fix, brush(Paint::Flatten), paint.clone()],
    );
    let now = scene(&workspace).shape;
    assert!(now[middle] == original[middle] && now != original);
    run(&mut workspace, [Command::GoTo { step: 0 }]);
    // A selection restricts a stroke.
    let right = original.iter().filter(|(_, p)| p.x > 0.0).map(|(v, _)| v);
    let select = Command::Select {
        vertices: right.collect(),
        how: Combine::Replace,
    };
    run(&mut workspace, [select, brush(Paint::Flatten), paint]);
    let now = scene(&workspace).shape;
    let mut left = original.iter().filter(|(_, p)| p.x <= 0.0);
    assert!(left.all(|(v, p)| now[v] == *p) && now != original);
    run(&mut workspace, [Command::GoTo { step: 0 }]);
    // Across the mirror a stroke is painted twice.
    let mirror = Some(Mirror {
        point: Vector3::zeros(),
        normal: Vector3::x(),
    });
    let stroke = vec![at(&workspace, 1.2, 0.0)];
    let paint = Command::Paint { stroke };
    let twice = [Command::SetMirror { mirror }, brush(Paint::Flatten), paint];
    run(&mut workspace, twice);
    let now = scene(&workspace).shape;
    let moved = |side: f64| {
        let on_side = original.iter().filter(|(_, p)| p.x * side > 0.5);
        on_side.filter(|(v, p)| now[*v] != **p).count()
    };
    assert!(
        moved(1.0) > 10 && moved(-1.0) > 10,
        "{} {}",
        moved(1.0),
        moved(-1.0)
    );
}
