//! Properties of every model of several parts.

use cotan::prelude::*;
use cotan::{PartReport, Parts, Role, Ties};

use crate::cases::{self, Case};
use crate::models::{alone, farthest, of_part, together, turn, worst};

fn handles(case: &Case, shape: &Mesh<f64>, number: impl Fn(usize) -> usize) -> Handles<f64> {
    let still = of_part(shape, number(case.still.0), case.still.1);
    let moved = of_part(shape, number(case.moved.0), case.moved.1);
    assert!(!still.is_empty() && !moved.is_empty(), "{}", case.name);
    Handles::new().fix(still).transform(moved, case.motion)
}

fn run(case: &Case) -> (Mesh<f64>, Deformed<f64>) {
    let shape = case.shape();
    let handles = handles(case, &shape, |p| p);
    let deformed = deform(&shape, &handles, &DeformOptions::default()).unwrap();
    (shape, deformed)
}

/// Passengers keep their places: the gap changes by less than .4 % of the size, and no part turns
/// by more than 2° against what it touches.
#[test]
fn parts_keep_their_places() {
    for case in cases::all() {
        let (_, deformed) = run(&case);
        let [gap, turn] = worst(&deformed.parts);
        println!(
            "{:24} gap {:.4} %, turn {turn:.2}°, {} iterations",
            case.name,
            gap * 100.0,
            deformed.report.iterations
        );
        for (k, part) in deformed.parts.iter().enumerate() {
            if part.gap_change > 1e-3 || part.turn_degrees > 1.0 {
                println!("  {k}: {part:?}");
            }
        }
        assert_eq!(deformed.report.stop, StopReason::Converged, "{}", case.name);
        assert!(gap < 0.004, "{}: {gap}", case.name);
        assert!(turn < 2.0, "{}: {turn}", case.name);
    }
}

/// A copy of the body that is bent stays on it.
#[test]
fn a_duplicate_stays_on_its_original() {
    let (shape, deformed) = run(&cases::duplicates());
    let [body, copy] = [0, 1].map(|part| of_part(&shape, part, |_| true));
    let place = |v: &VertexId| deformed.positions[*v];
    assert_eq!(body.len(), copy.len());
    for (a, b) in body.iter().zip(&copy) {
        assert!((place(a) - place(b)).norm() < 1e-12, "{a:?}");
    }
}

/// A part that drives alone has the shape that it would have by itself, bit by bit.
#[test]
fn a_driver_is_what_it_is_alone() {
    for case in cases::all().iter().filter(|case| case.moved.0 == 0) {
        let (shape, deformed) = run(case);
        let (own, vertices) = alone(&shape, 0);
        let single = deform(&own, &handles(case, &own, |_| 0), &DeformOptions::default());
        let single = single.unwrap();
        let of_whole: Positions<f64> = vertices.iter().map(|v| deformed.positions[*v]).collect();
        assert_eq!(of_whole, single.positions, "{}", case.name);
        assert_eq!(deformed.report.iterations, single.report.iterations);
        let roles = |p: &PartReport| p.role;
        assert_eq!(deformed.parts.first().map(roles), Some(Role::Drives));
    }
}

/// All handles moved by one rigid motion move the whole model by it.
#[test]
fn rigid_motions_are_exact() {
    let motion = turn([0.3, -0.2, 0.5], Vector3::new(1.0, 2.0, 3.0), 70.0);
    for case in cases::all() {
        let shape = case.shape();
        let still = of_part(&shape, case.still.0, case.still.1);
        let moved = of_part(&shape, case.moved.0, case.moved.1);
        let handles = Handles::new()
            .transform(still, motion)
            .transform(moved, motion);
        let deformed = deform(&shape, &handles, &DeformOptions::default()).unwrap();
        let wanted = shape.positions().map(|p| motion.transform_point(p));
        let error = farthest(&deformed.positions, &wanted);
        assert!(error < 1e-9, "{}: {error:e}", case.name);
    }
}

/// Handles in place change no byte.
#[test]
fn handles_in_place_change_nothing() {
    for case in cases::all() {
        let shape = case.shape();
        let still = of_part(&shape, case.still.0, case.still.1);
        let moved = of_part(&shape, case.moved.0, case.moved.1);
        let handles = Handles::new().fix(still).fix(moved);
        let deformed = deform(&shape, &handles, &DeformOptions::default()).unwrap();
        assert_eq!(&deformed.positions, shape.positions(), "{}", case.name);
    }
}

/// The order of the parts in the mesh says nothing.
#[test]
fn the_order_of_parts_changes_nothing() {
    for case in cases::all() {
        let n = case.parts.len();
        let (_, first) = run(&case);
        let reversed: Vec<Mesh<f64>> = case.parts.iter().rev().cloned().collect();
        let shape = together(&reversed);
        let handles = handles(&case, &shape, |p| n - 1 - p);
        let second = deform(&shape, &handles, &DeformOptions::default()).unwrap();
        let sizes: Vec<usize> = reversed.iter().map(Mesh::num_vertices).collect();
        let mut end = shape.num_vertices();
        let mut back: Vec<Point3<f64>> = Vec::new();
        for size in sizes.iter().rev() {
            back.extend(&second.positions.as_slice()[end - size..end]);
            end -= size;
        }
        let error = farthest(&first.positions, &back.into_iter().collect());
        assert!(error < 1e-8, "{}: {error:e}", case.name);
    }
}

/// Parts may be told to stay, to be free, or not to be tied to one another.
#[test]
fn options_choose_what_follows() {
    let case = cases::screws(3);
    let shape = case.shape();
    let handles = handles(&case, &shape, |p| p);
    let run = |parts, ties| {
        let options = DeformOptions::default().parts(parts).ties(ties);
        deform(&shape, &handles, &options)
    };
    assert!(run(Parts::Still, Ties::default()).is_err());
    let only = run(Parts::Only(vec![2, 5]), Ties::default()).unwrap();
    let roles: Vec<Role> = only.parts.iter().map(|p| p.role).collect();
    let follows = |p: usize| roles[p] == Role::Follows;
    assert!(
        (1..10).all(|p| follows(p) == [2, 5].contains(&p)),
        "{roles:?}"
    );
    for v in of_part(&shape, 3, |_| true) {
        assert_eq!(only.positions[v], shape.positions()[v]);
    }
    let free = run(Parts::Follow, Ties::default().free(vec![4])).unwrap();
    assert_eq!(free.parts[4].role, Role::Still);
    let untied = run(Parts::Follow, Ties::default().untied(vec![[4, 0]])).unwrap();
    assert!(!untied.parts[4].follows.contains(&0));
    let error = run(Parts::Only(vec![10]), Ties::default()).unwrap_err();
    assert!(matches!(
        error,
        Error::NoSuchPart {
            part: 10,
            num_parts: 10
        }
    ));
    assert!(run(Parts::Follow, Ties::default().strength(0.0)).is_err());
}

/// In a session passengers follow every frame, and one that gets a handle drives.
#[test]
fn a_passenger_with_a_handle_drives() {
    let case = cases::screws(2);
    let shape = case.shape();
    let handles = handles(&case, &shape, |p| p);
    let mut session = Session::new(&shape, &handles, &DeformOptions::default()).unwrap();
    session.step().unwrap();
    assert!(worst(&session.parts())[0] < 0.004);
    let _ = session.run().unwrap();
    let before = session.positions();
    let screw = of_part(&shape, 3, |_| true);
    let place = screw.iter().map(|v| before[*v] + Vector3::z()).collect();
    session
        .add_handle(screw.clone(), Motion::To(place))
        .unwrap();
    assert_eq!(session.parts()[3].role, Role::Drives);
    let _ = session.run().unwrap();
    for v in screw {
        assert!((session.positions()[v] - before[v] - Vector3::z()).norm() < 1e-12);
    }
    session.remove_handle(2).unwrap();
    let _ = session.run().unwrap();
    assert_eq!(session.parts()[3].role, Role::Follows);
    assert!(farthest(&session.positions(), &before) < 1e-3);
}

/// In single precision as in double.
#[test]
fn single_precision_agrees() {
    let case = cases::screws(3);
    let (shape, double) = run(&case);
    let single = shape.cast::<f32>();
    let handles = handles(&case, &shape, |p| p);
    let mut narrow = Handles::<f32>::new();
    for group in &handles {
        narrow = match group.motion() {
            Motion::Transform(matrix) => {
                narrow.transform(group.vertices().to_vec(), matrix.cast::<f32>())
            }
            _ => narrow.fix(group.vertices().to_vec()),
        };
    }
    let deformed = deform(&single, &narrow, &DeformOptions::default()).unwrap();
    let wide = deformed.positions.map(|p| p.cast::<f64>());
    assert!(farthest(&wide, &double.positions) < 1e-3);
}

#[test]
fn thousands_of_screws_follow() {
    let case = cases::screws(63);
    let (_, deformed) = run(&case);
    assert_eq!(case.parts.len(), 63 * 63 + 1);
    let [gap, turn] = worst(&deformed.parts);
    assert!(gap < 0.004 && turn < 2.0);
}
