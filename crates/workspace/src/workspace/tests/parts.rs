//! Models of several parts: following, staying behind, hidden and isolated.

use super::*;
use crate::settings::Others;

/// Two balls of radius 1, the second with its centre at (3, 0, 0).
fn two_balls(folder: &Path) -> (Workspace, usize) {
    let path = folder.join("two.obj");
    let ball = cotan::shapes::icosphere::<f64>(2);
    let mut points: Vec<_> = ball.positions().values().copied().collect();
    let n = points.len();
    points.extend(ball.positions().values().map(|p| p + Vector3::x() * 3.0));
    let corners = ball.to_triangles();
    let moved = corners.iter().map(|v| v + n as u32);
    let both: Vec<u32> = corners.iter().copied().chain(moved).collect();
    let faces = both.chunks(3).map(<[u32]>::to_vec).collect();
    let document = Document::new(points, faces).unwrap();
    cotan_io::save(&document, &path).unwrap();
    (open(&path), n)
}

fn select(vertices: impl IntoIterator<Item = usize>) -> Command {
    Command::Select {
        vertices: vertices.into_iter().map(VertexId::new).collect(),
        how: Combine::Replace,
    }
}

/// Makes the first ball a handle.
fn hold_the_first(workspace: &mut Workspace) {
    let role = Role::Movable;
    let hold = Command::MakeHandle { role };
    run(workspace, [select([0]), Command::SelectLinked, hold]);
}

/// Drags the first handle upwards, and returns the ways out that were offered meanwhile.
fn drag_up(workspace: &mut Workspace, by: f64) -> Vec<(&'static str, Command)> {
    let motion = nalgebra::Matrix4::new_translation(&(Vector3::z() * by));
    let mut effects = workspace.apply(Command::Grab { handle: 0 });
    effects.extend(workspace.apply(Command::Drag { motion }));
    workspace.finish();
    effects.extend(workspace.apply(Command::Drop));
    workspace.finish();
    let offers = effects.into_iter().filter_map(|effect| match effect {
        Effect::Offered { text, ways } => {
            assert!(text.contains("1 part without handles"), "{text}");
            Some(ways)
        }
        _ => None,
    });
    offers.flatten().collect()
}

/// The displacements of the second ball, which was `n` vertices behind the first.
fn of_the_second(workspace: &Workspace, n: usize) -> Vec<Vector3<f64>> {
    let original = workspace.model().unwrap().original();
    let shape = &workspace.scene().unwrap().shape;
    let second = shape.iter().filter(|(v, _)| v.index() >= n);
    second.map(|(v, p)| p - original[v]).collect()
}

#[test]
fn what_is_left_behind_is_fixed_by_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let (mut workspace, n) = two_balls(folder.path());
    run(&mut workspace, [select([3]), Command::FixTheRest]);
    let now = scene(&workspace);
    let [rest] = now.handles() else {
        panic!("{:?}", now.handles());
    };
    assert_eq!(rest.vertices.len(), n);
    assert!(rest.vertices.iter().all(|v| now.shape[*v].x > 1.5));
    assert_eq!(now.selection(), [VertexId::new(3)]);
    run(&mut workspace, [Command::SelectLinked]);
    assert_eq!(scene(&workspace).selection().len(), n);
}

#[test]
fn a_part_without_handles_follows_a_drag() {
    let folder = tempfile::tempdir().unwrap();
    let (mut workspace, n) = two_balls(folder.path());
    hold_the_first(&mut workspace);
    assert!(drag_up(&mut workspace, 0.5).is_empty());
    for way in of_the_second(&workspace, n) {
        assert!((way - Vector3::z() * 0.5).norm() < 1e-9, "{way}");
    }
}

#[test]
fn parts_that_would_stay_behind_are_told_of_with_ways_out() {
    let folder = tempfile::tempdir().unwrap();
    let (mut workspace, n) = two_balls(folder.path());
    hold_the_first(&mut workspace);
    for influence in [None, Some(Influence::default())] {
        let others = match influence {
            None => Others::Stay,
            Some(_) => Others::Follow,
        };
        let follow = Follow {
            influence,
            others,
            ..Follow::default()
        };
        run(&mut workspace, [Command::SetFollow { follow }]);
        let ways = drag_up(&mut workspace, 0.5);
        assert!(
            of_the_second(&workspace, n)
                .iter()
                .all(|way| way.norm() == 0.0)
        );
        // Told once, not at every drag.
        assert!(drag_up(&mut workspace, 0.4).is_empty());
        let [(_, let_follow), (_, fix)] = ways.as_slice() else {
            panic!("{ways:?}");
        };
        run(&mut workspace, [fix.clone()]);
        assert_eq!(workspace.model().unwrap().num_left_behind(), 0);
        run(&mut workspace, [Command::Undo, let_follow.clone()]);
        assert!(drag_up(&mut workspace, 0.3).is_empty());
        let way = of_the_second(&workspace, n)[0];
        assert!((way - Vector3::z() * 0.3).norm() < 1e-9, "{way}");
    }
}

#[test]
fn what_is_hidden_cannot_be_selected_until_it_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let (mut workspace, n) = two_balls(folder.path());
    let isolate = [select([0]), Command::SelectLinked, Command::HideOthers];
    run(&mut workspace, isolate);
    assert_eq!(scene(&workspace).hidden().len(), n);
    assert_eq!(scene(&workspace).selection().len(), n);
    run(&mut workspace, [Command::SelectAll]);
    assert_eq!(scene(&workspace).selection().len(), n);
    run(&mut workspace, [Command::HideSelection]);
    assert_eq!(scene(&workspace).hidden().len(), 2 * n);
    assert!(scene(&workspace).selection().is_empty());
    run(&mut workspace, [select([1, n + 1])]);
    assert!(scene(&workspace).selection().is_empty());
    // A project keeps what is hidden, and nobody is asked to save it.
    assert!(!workspace.is_changed());
    let path = folder.path().join("a.cotan");
    let over = Over::Own;
    run(
        &mut workspace,
        [Command::SaveAs {
            path: path.clone(),
            over,
        }],
    );
    assert_eq!(scene(&open(&path)).hidden(), scene(&workspace).hidden());
    run(&mut workspace, [Command::ShowAll, select([1, n + 1])]);
    assert_eq!(scene(&workspace).selection().len(), 2);
    run(&mut workspace, [Command::Undo, Command::Undo]);
    assert_eq!(scene(&workspace).hidden().len(), 2 * n);
}
