//! Vertices of high valence: no strategy grows with the square of a valence, and all of them
//! give the correction of the normal equations.

use cotan_geometry::shapes::{bipyramid, icosphere};
use cotan_geometry::{Mesh, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Cotangent, EdgeLength, LaplacianScheme, OneRings, Operator, Tutte, Uniform};
use cotan_linear::{
    Defect, Handle, Hold, LinearError, Membrane, Method, PreparedSystem, Strategy, SystemOptions,
};
use nalgebra::{DMatrix, DVector, Vector3};

fn options(strategy: Strategy) -> SystemOptions {
    SystemOptions::new().strategy(strategy)
}

fn field(n: usize, phase: f64) -> VertexMap<Vector3<f64>> {
    VertexMap::from_fn(n, |v: VertexId| {
        let t = v.index() as f64;
        Vector3::new((t + phase).sin(), (2.0 * t - phase).cos(), (0.1 * t).sin())
    })
}

fn corrected(system: &mut PreparedSystem, n: usize) -> VertexMap<Vector3<f64>> {
    let mut correction = VertexMap::filled(n, Vector3::zeros());
    let (mismatch, pull) = (field(n, 0.3), field(n, 2.7));
    let defect = Defect::of_laplacian(&mismatch).with_pull(&pull);
    system
        .correct(&defect, &mut correction)
        .expect("a correction");
    correction
}

fn schemes() -> [Box<dyn LaplacianScheme<f64>>; 4] {
    [
        Box::new(Cotangent::default()),
        Box::new(Tutte),
        Box::new(Uniform),
        Box::new(EdgeLength),
    ]
}

/// Several of them, one behind the other on a ring that they share: a fan of valence `valence`
/// at each of `hubs` vertices of an open strip.
fn hubs_on_an_open_mesh(hubs: usize, valence: usize) -> Mesh<f64> {
    let mut points = Vec::new();
    let mut faces = Vec::new();
    let first_hub = (hubs * valence + 1) as u32;
    for k in 0..=hubs * valence {
        let x = k as f64 / valence as f64;
        points.push(nalgebra::Point3::new(x, (0.7 * x).sin(), 0.0));
    }
    for hub in 0..hubs {
        let x = hub as f64 + 0.5;
        points.push(nalgebra::Point3::new(x, 1.5 + (0.7 * x).sin(), 0.3));
        for k in hub * valence..(hub + 1) * valence {
            faces.push([k as u32, k as u32 + 1, first_hub + hub as u32]);
        }
        if hub > 0 {
            let at = (hub * valence) as u32;
            faces.push([at, first_hub + hub as u32, first_hub + hub as u32 - 1]);
        }
    }
    Mesh::new(
        HalfedgeMesh::from_faces(points.len(), &faces).expect("a strip"),
        VertexMap::from_vec(points),
    )
    .expect("a surface")
}

/// LᵀL + μK + D as it is defined, dense.
fn dense_correction(
    operator: &Operator<f64>,
    handles: &[Handle],
    membrane: Option<Membrane<'_>>,
) -> VertexMap<Vector3<f64>> {
    let n = operator.num_rows();
    let l = DMatrix::from(&operator.matrix());
    let mut m = l.transpose() * &l;
    let mut right = DMatrix::<f64>::zeros(n, 3);
    let (mismatch, pull) = (field(n, 0.3), field(n, 2.7));
    for axis in 0..3 {
        let y = DVector::from_iterator(n, mismatch.values().map(|v| v[axis]));
        right.set_column(axis, &-(l.transpose() * y));
    }
    if let Some(Membrane { weight, weights }) = membrane {
        for i in 0..n {
            for (j, k) in operator.graph().row(i) {
                m[(i, i)] += weight * (0.5 * weights[k]);
                m[(i, j.index())] -= weight * (0.5 * weights[k]);
            }
        }
    }
    for handle in handles {
        let i = handle.vertex.index();
        match handle.hold {
            Hold::Soft(k) => {
                let spring = (k * operator.mean_diagonal()).powi(2);
                m[(i, i)] += spring;
                for axis in 0..3 {
                    right[(i, axis)] += spring * pull[handle.vertex][axis];
                }
            }
            Hold::Hard => {
                m.row_mut(i).fill(0.0);
                m.column_mut(i).fill(0.0);
                m[(i, i)] = 1.0;
                right.row_mut(i).fill(0.0);
            }
        }
    }
    let x = m.lu().solve(&right).expect("a solution");
    VertexMap::from_fn(n, |v: VertexId| {
        Vector3::new(x[(v.index(), 0)], x[(v.index(), 1)], x[(v.index(), 2)])
    })
}

fn apart(a: &VertexMap<Vector3<f64>>, b: &VertexMap<Vector3<f64>>) -> f64 {
    let size = a.values().map(|a| a.norm()).fold(1e-300, f64::max);
    let difference = a.values().zip(b.values()).map(|(a, b)| (a - b).norm());
    difference.fold(0.0, f64::max) / size
}

#[test]
fn rows_in_pieces_give_the_correction_of_the_normal_equations() {
    for shape in [
        bipyramid::<f64>(150),
        bipyramid(401),
        hubs_on_an_open_mesh(3, 140),
    ] {
        let n = shape.positions().len();
        let at = |i: usize| VertexId::new(i);
        // A hub held hard, softly, and not at all; all vertices held, as smoothing has it.
        let few = [
            Handle::hard(at(0)),
            Handle::soft(at(n / 3), 0.5),
            Handle::hard(at(n / 2)),
        ];
        let at_hub = [Handle::hard(at(n - 1)), Handle::soft(at(n - 2), 2.0)];
        let all: Vec<Handle> = (0..n).map(|i| Handle::soft(at(i), 0.2)).collect();
        for scheme in &schemes() {
            let operator = Operator::assemble(&**scheme, &shape.surface()).unwrap();
            let halfedges = OneRings::new(shape.connectivity()).halfedges().to_vec();
            let uneven: Vec<f64> = halfedges
                .iter()
                .map(|h| 2.0 + 2.0 * (h.edge().index() % 3) as f64)
                .collect();
            let membranes = [
                None,
                Some(Membrane {
                    weight: 0.4,
                    weights: &uneven,
                }),
            ];
            for (handles, membrane) in [
                (&few[..], membranes[0]),
                (&few, membranes[1]),
                (&at_hub, membranes[1]),
                (&all, membranes[0]),
            ] {
                let normal = options(Strategy::Normal);
                let mut system =
                    PreparedSystem::prepare_with(&operator, handles, membrane, &normal).unwrap();
                assert_eq!(system.choice().method, Method::Normal);
                let expected = dense_correction(&operator, handles, membrane);
                let first = corrected(&mut system, n);
                let apart = apart(&expected, &first);
                assert!(
                    apart < 1e-6,
                    "{apart:e} by {}",
                    LaplacianScheme::<f64>::name(&**scheme)
                );
                // Solved again, and factorized again: the links remember nothing.
                assert_eq!(corrected(&mut system, n), first);
                system.refactor(&operator, membrane).unwrap();
                assert_eq!(corrected(&mut system, n), first);
            }
        }
    }
}

/// Entries of the factor in proportion to the vertices, where the square of the valence would be
/// 250 times as many.
#[test]
fn no_strategy_is_quadratic_in_a_valence() {
    let size = |valence: usize, strategy: Strategy| {
        let shape = bipyramid::<f64>(valence);
        let surface = Surface::new(shape.connectivity(), shape.positions()).unwrap();
        let operator = Operator::assemble(&Cotangent::default(), &surface).unwrap();
        let handles = [3, valence / 2, valence].map(|i| Handle::hard(VertexId::new(i)));
        let system =
            PreparedSystem::prepare_with(&operator, &handles, None, &options(strategy)).unwrap();
        system.factor_entries() as f64 / valence as f64
    };
    for strategy in [Strategy::Normal, Strategy::Columns, Strategy::Iterative] {
        let (small, large) = (size(1_000, strategy), size(16_000, strategy));
        println!("{strategy}: {small:.1} and {large:.1} entries per vertex");
        assert!(large < 2.0 * small, "{strategy}: {small} {large}");
        assert!(large < 300.0, "{strategy}: {large}");
    }
}

/// However the vertices are numbered: pieces follow the ring, not the numbers.
#[test]
fn scattered_indices_do_not_fill_the_factor() {
    let n = 4_001;
    let shape = bipyramid::<f64>(n - 2);
    // A permutation, as 1,361 and 4,001 have no common divisor.
    let number = |i: usize| (i * 1_361 + 17) % n;
    let faces: Vec<[u32; 3]> = shape
        .connectivity()
        .faces()
        .map(|f| {
            shape
                .connectivity()
                .triangle(f)
                .map(|v| number(v.index()) as u32)
        })
        .collect();
    let mesh = HalfedgeMesh::from_faces(n, &faces).unwrap();
    let mut positions = shape.positions().clone();
    for (v, p) in shape.positions().iter() {
        positions[VertexId::new(number(v.index()))] = *p;
    }
    let surface = Surface::new(&mesh, &positions).unwrap();
    let operator = Operator::assemble(&Uniform, &surface).unwrap();
    let handles: Vec<Handle> = mesh.vertices().map(|v| Handle::soft(v, 0.2)).collect();
    let system =
        PreparedSystem::prepare_with(&operator, &handles, None, &options(Strategy::Normal));
    let entries = system.unwrap().factor_entries() / n;
    assert!(entries < 100, "{entries} per vertex");
}

#[test]
fn iteration_agrees_with_factors_at_a_high_valence() {
    let shape = bipyramid::<f64>(7_000);
    let n = shape.positions().len();
    let operator = Operator::assemble(&Uniform, &shape.surface()).unwrap();
    let handles = [3, 3_000, 7_001].map(|i| Handle::hard(VertexId::new(i)));
    let by = |strategy| {
        let options = options(strategy);
        let system = PreparedSystem::prepare_with(&operator, &handles, None, &options);
        corrected(&mut system.unwrap(), n)
    };
    let apart = apart(&by(Strategy::Columns), &by(Strategy::Iterative));
    assert!(apart < 1e-6, "{apart:e}");
}

/// A product that does not fit is refused before it is assembled, whatever is known of its factor.
#[test]
fn a_product_that_does_not_fit_is_refused_unassembled() {
    for shape in [icosphere::<f64>(4), bipyramid(5_000)] {
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let handles = [
            Handle::hard(VertexId::new(0)),
            Handle::hard(VertexId::new(7)),
        ];
        let options = options(Strategy::Normal).max_memory(100_000);
        let refused = PreparedSystem::prepare_with(&operator, &handles, None, &options);
        assert!(matches!(
            refused.map(|_| ()),
            Err(LinearError::MemoryLimit {
                permitted: 100_000,
                ..
            })
        ));
    }
}
