//! All strategies give the same corrections, whatever the surface, the scheme and the handles, and
//! however the handles came to be.

use cotan_geometry::testing::surfaces;
use cotan_geometry::{Positions, Scalar, Surface, shapes};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{
    ClampedCotangent, Cotangent, EdgeLength, LaplacianScheme, OneRings, Operator, Tutte, Uniform,
};
use cotan_linear::{
    Defect, Handle, LinearError, Membrane, Method, Precision, PreparedSystem, Reason, Strategy,
    SystemOptions,
};
use nalgebra::{Point3, Vector3};
use proptest::prelude::{any, prop_assert, prop_assert_eq, prop_assume, proptest};
use proptest::test_runner::Config;

/// A mesh of one component or of two copies of it.
fn copies(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    count: usize,
) -> (HalfedgeMesh, Positions<f64>) {
    let n = positions.len();
    let faces: Vec<[u32; 3]> = (0..count)
        .flat_map(|copy| {
            mesh.faces()
                .map(move |f| mesh.triangle(f).map(|v| (v.index() + copy * n) as u32))
        })
        .collect();
    let all = (0..count)
        .flat_map(|copy| {
            positions
                .values()
                .map(move |p| p + Vector3::x() * (30.0 * copy as f64))
        })
        .collect();
    (
        HalfedgeMesh::from_faces(n * count, &faces).expect("copies of a manifold"),
        VertexMap::from_vec(all),
    )
}

/// Handles at every component of `n` vertices, a fixed choice for every seed: `per_component` of
/// them, every second one soft if `soft`.
fn handles(
    n: usize,
    components: usize,
    per_component: usize,
    soft: bool,
    seed: usize,
) -> Vec<Handle> {
    let mut handles = Vec::new();
    for component in 0..components {
        let start = component * n;
        let mut vertices: Vec<usize> = (0..per_component)
            .map(|k| start + (seed * 31 + k * k * 7 + k * n / per_component) % n)
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        handles.extend(vertices.into_iter().enumerate().map(|(k, i)| {
            let vertex = VertexId::new(i);
            match soft && (k + seed).is_multiple_of(2) {
                true => Handle::soft(vertex, [0.3, 2.0, 50.0][k % 3]),
                false => Handle::hard(vertex),
            }
        }));
    }
    handles
}

fn scheme(kind: usize) -> Box<dyn LaplacianScheme<f64>> {
    match kind {
        0 => Box::new(Cotangent::default()),
        1 => Box::new(Tutte),
        2 => Box::new(Uniform),
        3 => Box::new(EdgeLength),
        _ => Box::new(ClampedCotangent::default()),
    }
}

fn field(n: usize, phase: f64) -> VertexMap<Vector3<f64>> {
    VertexMap::from_fn(n, |v: VertexId| {
        let t = v.index() as f64;
        Vector3::new(
            (t + phase).sin(),
            (2.0 * t - phase).cos(),
            (0.1 * t * phase).sin(),
        )
    })
}

/// Residual and correction for a right-hand side without structure.
fn corrected<T: Scalar>(
    system: &mut PreparedSystem,
    operator: &Operator<T>,
) -> [VertexMap<Vector3<f64>>; 2] {
    let n = operator.num_rows();
    let shift = field(n, 1.1);
    let tension = VertexMap::from_fn(n, |v: VertexId| {
        let ring = operator.graph().row(v.index());
        ring.map(|(j, _)| shift[VertexId::new(j.index())] - shift[v])
            .sum()
    });
    let zeros = VertexMap::filled(n, Vector3::zeros());
    let (mut residual, mut correction) = (zeros.clone(), zeros);
    let (laplacian, pull) = (field(n, 0.3), field(n, 2.7));
    let defect = Defect::of_laplacian(&laplacian)
        .with_tension(&tension)
        .with_pull(&pull);
    system.residual(&defect, &mut residual);
    system
        .correct(&defect, &mut correction)
        .expect("a correction");
    [residual, correction]
}

/// The largest difference over the largest value.
fn apart(a: &VertexMap<Vector3<f64>>, b: &VertexMap<Vector3<f64>>) -> f64 {
    let size = a
        .values()
        .map(|a| a.norm())
        .fold(f64::MIN_POSITIVE, f64::max);
    let difference = a.values().zip(b.values()).map(|(a, b)| (a - b).norm());
    difference.fold(0.0, f64::max) / size
}

const NORMAL: SystemOptions = options(Strategy::Normal);
const COLUMNS: SystemOptions = options(Strategy::Columns);

const fn options(strategy: Strategy) -> SystemOptions {
    SystemOptions::new().strategy(strategy)
}

proptest! {
    #![proptest_config(Config::with_cases(64))]

    #[test]
    fn all_strategies_agree(
        shape in surfaces(), kind in 0usize..5, components in 1usize..4, count in 1usize..12,
        soft in any::<bool>(), with_membrane in any::<bool>(), weight in 0.001f64..3.0,
        seed in 0usize..100,
    ) {
        let (mesh, positions) = copies(shape.connectivity(), shape.positions(), components);
        let n = positions.len();
        let operator = Operator::assemble(&*scheme(kind), &Surface::new(&mesh, &positions)?)?;
        let weights = operator.weights();
        let membrane = (with_membrane && kind != 1)
            .then_some(Membrane { weight, weights });
        let held = handles(n / components, components, count, soft, seed);
        let mut normal = PreparedSystem::prepare_with(&operator, &held, membrane, &NORMAL)?;
        let mut columns = PreparedSystem::prepare_with(&operator, &held, membrane, &COLUMNS)?;
        let mut auto = PreparedSystem::prepare(&operator, &held, membrane)?;
        let [residual, expected] = corrected(&mut normal, &operator);
        for system in [&mut columns, &mut auto] {
            let [other_residual, correction] = corrected(system, &operator);
            prop_assert!(apart(&residual, &other_residual) <= 1e-12);
            let apart = apart(&expected, &correction);
            prop_assert!(apart <= 1e-6, "{apart} by {}", system.choice());
            for handle in &held {
                let is_hard = handle.hold == cotan_linear::Hold::Hard;
                prop_assert!(!is_hard || correction[handle.vertex] == Vector3::zeros());
            }
        }
    }

    /// After any exchanges of handles the system is what a new one would be.
    #[test]
    fn exchanged_handles_are_as_good_as_new_ones(
        shape in surfaces(), kind in 0usize..2, components in 1usize..3,
        steps in proptest::collection::vec((1usize..10, any::<bool>(), 0usize..50), 1..6),
        with_membrane in any::<bool>(), strategy in 0usize..4,
    ) {
        let (mesh, positions) = copies(shape.connectivity(), shape.positions(), components);
        let n = positions.len();
        prop_assume!(n / components > 12);
        let operator = Operator::assemble(&*scheme(kind), &Surface::new(&mesh, &positions)?)?;
        let weights = operator.weights();
        let membrane = (with_membrane && kind != 1)
            .then_some(Membrane { weight: 0.2, weights });
        let options = options(Strategy::ALL[strategy]);
        let first = handles(n / components, components, 3, false, 7);
        let mut system = PreparedSystem::prepare_with(&operator, &first, membrane, &options)?;
        for (count, soft, seed) in steps {
            let held = handles(n / components, components, count, soft, seed);
            system.set_handles(&held)?;
            let chosen = self::options(system.choice().method.into());
            let mut new = PreparedSystem::prepare_with(&operator, &held, membrane, &chosen)?;
            let [expected_residual, expected] = corrected(&mut new, &operator);
            let [residual, correction] = corrected(&mut system, &operator);
            prop_assert!(apart(&expected_residual, &residual) <= 1e-12);
            let apart = apart(&expected, &correction);
            prop_assert!(apart <= 1e-9, "{apart} by {}", system.choice());
            prop_assert_eq!(system.num_unknowns(), new.num_unknowns());
        }
    }

    /// New weights are those of a new system.
    #[test]
    fn refactored_weights_are_as_good_as_new_ones(
        shape in surfaces(), strategy in 0usize..4, before in any::<bool>(), after in any::<bool>(),
    ) {
        let n = shape.positions().len();
        let surface = shape.surface();
        let stretched = shape.positions().map(|p| Point3::new(p.x, 1.3 * p.y, 0.8 * p.z));
        let first = Operator::assemble(&Cotangent::default(), &surface)?;
        let second = Operator::assemble(&Cotangent::default(), &surface.with_positions(&stretched))?;
        let stiffness = [&first, &second].map(|operator| operator.weights());
        let membrane = |k: usize, is_there: bool| {
            is_there.then_some(Membrane { weight: 0.3, weights: stiffness[k] })
        };
        let held = handles(n, 1, 3, false, 3);
        let options = options(Strategy::ALL[strategy]);
        let mut system = PreparedSystem::prepare_with(&first, &held, membrane(0, before), &options)?;
        system.refactor(&second, membrane(1, after))?;
        let mut new = PreparedSystem::prepare_with(&second, &held, membrane(1, after), &options)?;
        let [_, expected] = corrected(&mut new, &second);
        let [_, correction] = corrected(&mut system, &second);
        prop_assert!(apart(&expected, &correction) <= 1e-9);
    }
}

/// Columns of neighbours are nearly the same; what tells them apart is still there.
#[test]
fn adjacent_handles_are_distinguished() {
    let shape = shapes::creature::<f64>(40);
    let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
    let mut patch = vec![VertexId::new(17)];
    for at in 0..20 {
        for (neighbour, _) in operator.graph().row(patch[at].index()) {
            let neighbour = VertexId::new(neighbour.index());
            if !patch.contains(&neighbour) {
                patch.push(neighbour);
            }
        }
    }
    let held: Vec<Handle> = patch.into_iter().map(Handle::hard).collect();
    let weights = operator.weights();
    let membrane = Membrane {
        weight: 0.1,
        weights,
    };
    for membrane in [None, Some(membrane)] {
        let by = |options| {
            let mut system =
                PreparedSystem::prepare_with(&operator, &held, membrane, &options).unwrap();
            let [_, correction] = corrected(&mut system, &operator);
            correction
        };
        let apart = apart(&by(NORMAL), &by(COLUMNS));
        println!("{} handles: {apart:.1e}", held.len());
        assert!(apart < 1e-7, "{apart}");
    }
}

/// Weights that were computed in single precision are symmetric, row-scaled and proportional to
/// their membrane within its rounding.
#[test]
fn single_precision_takes_columns_too() {
    let double = shapes::creature::<f64>(16);
    let positions = double.positions().map(|p| p.map(|x| x as f32));
    let surface = Surface::new(double.connectivity(), &positions).unwrap();
    let held = handles(positions.len(), 1, 5, true, 1);
    let of_double = Operator::assemble(&Cotangent::default(), &double.surface()).unwrap();
    let membrane = Membrane {
        weight: 0.3,
        weights: of_double.weights(),
    };
    let by = |scheme: &dyn LaplacianScheme<f32>, membrane, options| {
        let operator = Operator::assemble(scheme, &surface).unwrap();
        let mut system =
            PreparedSystem::prepare_with(&operator, &held, membrane, &options).unwrap();
        let [_, correction] = corrected(&mut system, &operator);
        correction
    };
    let cotangent = Cotangent::default();
    for (scheme, membrane) in [
        (&cotangent as &dyn LaplacianScheme<f32>, Some(membrane)),
        (&cotangent, None),
        (&Tutte, None),
    ] {
        let apart = apart(
            &by(scheme, membrane, NORMAL),
            &by(scheme, membrane, COLUMNS),
        );
        assert!(apart < 1e-3, "{apart}");
    }
}

#[test]
fn a_refused_set_of_handles_leaves_the_system_as_it_was() {
    let shape = shapes::icosphere::<f64>(2);
    let n = shape.positions().len();
    let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
    let held = handles(n, 1, 4, true, 5);
    for options in [NORMAL, COLUMNS] {
        let mut system = PreparedSystem::prepare_with(&operator, &held, None, &options).unwrap();
        let before = corrected(&mut system, &operator);
        assert_eq!(system.set_handles(&[]), Err(LinearError::NoHandles));
        assert!(system.set_handles(&[held[0], held[0]]).is_err());
        assert_eq!(before, corrected(&mut system, &operator));
    }
}

#[test]
fn unsuitable_problems_fall_back_to_the_normal_equations_or_are_refused() {
    let shape = shapes::icosphere::<f64>(2);
    let surface = shape.surface();
    let held = [
        Handle::hard(VertexId::new(0)),
        Handle::hard(VertexId::new(9)),
    ];
    let cotangent = Operator::assemble(&Cotangent::default(), &surface).unwrap();
    let rings = OneRings::new(shape.connectivity());
    let uneven = rings
        .halfedges()
        .iter()
        .map(|h| 2.0 + 2.0 * (h.edge().index() % 3) as f64);
    let uneven: Vec<f64> = uneven.collect();
    let membrane = Some(Membrane {
        weight: 0.5,
        weights: &uneven,
    });
    let system = PreparedSystem::prepare(&cotangent, &held, membrane).unwrap();
    assert_eq!(system.choice().method, Method::Normal);
    assert_eq!(system.choice().reason, Reason::OtherMembrane);
    let refused = PreparedSystem::prepare_with(&cotangent, &held, membrane, &COLUMNS);
    assert_eq!(
        refused.map(|_| ()).unwrap_err(),
        LinearError::StrategyUnsuitable {
            strategy: Strategy::Columns,
            reason: Reason::OtherMembrane
        }
    );
}

#[test]
fn a_system_that_does_not_fit_into_memory_is_refused_before_it_is_factorized() {
    let shape = shapes::icosphere::<f64>(4);
    let n = shape.positions().len();
    let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
    let held = handles(n, 1, 8, false, 0);
    let prepare = |options| PreparedSystem::prepare_with(&operator, &held, None, &options);
    let refused = prepare(SystemOptions::new().max_memory(1 << 16));
    let Err(LinearError::MemoryLimit {
        predicted,
        permitted,
        ..
    }) = refused.map(|_| ())
    else {
        panic!("not refused")
    };
    assert_eq!(permitted, 1 << 16);
    assert!(predicted > 1 << 18);
    let system = prepare(SystemOptions::new().max_memory(predicted)).unwrap();
    assert!((system.factor_entries() as u64) * 8 < predicted);
}

#[test]
fn every_vertex_may_be_a_handle() {
    let shape = shapes::tetrahedron::<f64>();
    let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
    let hard: Vec<Handle> = shape.connectivity().vertices().map(Handle::hard).collect();
    let soft: Vec<Handle> = shape
        .connectivity()
        .vertices()
        .map(|v| Handle::soft(v, 2.0))
        .collect();
    for options in [NORMAL, COLUMNS] {
        let prepare =
            |held: &[Handle]| PreparedSystem::prepare_with(&operator, held, None, &options);
        let [_, correction] = corrected(&mut prepare(&hard).unwrap(), &operator);
        assert!(correction.values().all(|d| *d == Vector3::zeros()));
    }
    let by = |options| {
        let mut system = PreparedSystem::prepare_with(&operator, &soft, None, &options).unwrap();
        let [_, correction] = corrected(&mut system, &operator);
        correction
    };
    assert!(apart(&by(NORMAL), &by(COLUMNS)) < 1e-12);
}

/// On a mesh that is large enough for more than one level: iteration, and factors in single
/// precision, give what the normal equations give.
#[test]
fn iteration_and_single_precision_agree_with_the_normal_equations() {
    let shape = shapes::creature::<f64>(110);
    let n = shape.positions().len();
    let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
    let weights = operator.weights();
    for (weight, soft) in [(0.0, true), (0.05, false)] {
        let membrane = Some(Membrane { weight, weights });
        let held = handles(n, 1, 6, soft, 3);
        let by = |options: &SystemOptions| {
            let prepared = PreparedSystem::prepare_with(&operator, &held, membrane, options);
            corrected(&mut prepared.unwrap(), &operator)[1].clone()
        };
        let expected = by(&NORMAL);
        for options in [
            options(Strategy::Iterative),
            COLUMNS.precision(Precision::Single),
        ] {
            let apart = apart(&expected, &by(&options));
            assert!(apart < 1e-6, "{apart} by {options:?}");
        }
    }
}

/// Under a limit of memory what fits is taken, and what cannot fit is refused before it is
/// factorized.
#[test]
fn a_limit_of_memory_chooses_and_refuses() {
    let shape = shapes::creature::<f64>(110);
    let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
    let held = handles(shape.positions().len(), 1, 3, false, 1);
    let with = |options: SystemOptions| {
        PreparedSystem::prepare_with(&operator, &held, None, &options).map(|s| s.choice())
    };
    let all = SystemOptions::new();
    assert_eq!(with(all).unwrap().method, Method::Columns);
    for strategy in [Strategy::Normal, Strategy::Columns, Strategy::Iterative] {
        assert!(matches!(
            with(options(strategy).max_memory(1000)),
            Err(LinearError::MemoryLimit {
                permitted: 1000,
                ..
            })
        ));
    }
    assert!(matches!(
        with(all.max_memory(1000)),
        Err(LinearError::MemoryLimit { .. })
    ));
}
