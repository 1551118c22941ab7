//! Where the nodes put the meshes.
//!
//! Source: glTF 2.0 specification, sections 3.5.2 "Nodes and Hierarchy" and 3.7.3 "Skins".

use nalgebra::{Matrix3, Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};

use super::accessor::{no_such, problem};
use super::model::{Node, Root};
use crate::error::IoError;
use crate::limits::Limits;

/// From the coordinates of a mesh to those of the scene, and back.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Placement {
    linear: Matrix3<f64>,
    offset: Vector3<f64>,
    inverse: Matrix3<f64>,
    is_identity: bool,
    /// Whether it is a reflection, which turns faces round.
    pub(super) is_mirrored: bool,
}

impl Default for Placement {
    fn default() -> Self {
        Self {
            linear: Matrix3::identity(),
            offset: Vector3::zeros(),
            inverse: Matrix3::identity(),
            is_identity: true,
            is_mirrored: false,
        }
    }
}

impl Placement {
    /// `None` if the transform cannot be undone.
    fn new(matrix: &Matrix4<f64>) -> Option<Self> {
        let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let offset: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        let bottom = matrix.row(3);
        let is_affine =
            bottom[0] == 0.0 && bottom[1] == 0.0 && bottom[2] == 0.0 && bottom[3] == 1.0;
        let inverse = linear.try_inverse()?;
        let finite = linear.iter().chain(&offset).chain(&inverse);
        // What a change of scale does to a determinant must not hide that it is zero.
        let condition = linear.norm() * inverse.norm();
        if !is_affine || !finite.copied().all(f64::is_finite) || !(condition < 1e12) {
            return None;
        }
        Some(Self {
            is_identity: linear == Matrix3::identity() && offset == Vector3::zeros(),
            is_mirrored: linear.determinant() < 0.0,
            linear,
            offset,
            inverse,
        })
    }

    #[inline]
    pub(super) fn to_scene(&self, p: Point3<f64>) -> Point3<f64> {
        if self.is_identity {
            p
        } else {
            self.linear * p + self.offset
        }
    }

    pub(super) fn to_mesh(&self, p: Point3<f64>) -> Point3<f64> {
        if self.is_identity {
            p
        } else {
            self.inverse * (p - self.offset)
        }
    }

    /// A normal turned as the surface is; its length stays.
    pub(super) fn normal_to_scene(&self, n: Vector3<f64>) -> Vector3<f64> {
        if self.is_identity {
            n
        } else {
            with_length(self.inverse.tr_mul(&n), n.norm())
        }
    }

    /// The other way round.
    pub(super) fn normal_to_mesh(&self, n: Vector3<f64>) -> Vector3<f64> {
        if self.is_identity {
            n
        } else {
            with_length(self.linear.tr_mul(&n), n.norm())
        }
    }
}

fn with_length(n: Vector3<f64>, length: f64) -> Vector3<f64> {
    n.try_normalize(0.0).unwrap_or_default() * length
}

/// How each mesh is placed.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Placements {
    /// By mesh; a mesh that no node shows stays where it is.
    pub(super) meshes: Vec<Placement>,
    /// Meshes whose transform cannot be undone, so that they are read as if they had none.
    pub(super) singular: Vec<usize>,
    /// Meshes that are shown more than once, and how often.
    pub(super) instances: Vec<(usize, usize)>,
}

impl Placements {
    /// Each mesh as the first node shows it: first the nodes of the scene, depth first, then those
    /// of the other scenes, then the rest.
    pub(super) fn new(root: &Root<'_>, limits: &Limits) -> Result<Self, IoError> {
        let nodes = &root.nodes;
        let tree = Tree::new(nodes)?;
        let globals = tree.globals(nodes, limits)?;
        let mut shown: Vec<Option<usize>> = vec![None; root.meshes.len()];
        let mut counts = vec![0usize; root.meshes.len()];
        for node in tree.order(root)? {
            let Some(mesh) = nodes[node].mesh else {
                continue;
            };
            let place = usize::try_from(mesh).ok().filter(|&m| m < shown.len());
            let Some(mesh) = place else {
                let path = format!("nodes[{node}].mesh");
                return Err(no_such("mesh", mesh, shown.len(), path));
            };
            shown[mesh].get_or_insert(node);
            counts[mesh] += 1;
        }
        let mut singular = Vec::new();
        let meshes = shown.iter().enumerate().map(|(mesh, node)| {
            let node = node.filter(|&node| nodes[node].skin.is_none());
            let Some(node) = node else {
                return Placement::default();
            };
            Placement::new(&globals[node]).unwrap_or_else(|| {
                singular.push(mesh);
                Placement::default()
            })
        });
        let meshes = meshes.collect();
        let counts = counts.into_iter().enumerate();
        Ok(Self {
            meshes,
            singular,
            instances: counts.filter(|&(_, count)| count > 1).collect(),
        })
    }
}

/// The nodes, known to be trees.
struct Tree {
    /// Nodes without a parent.
    roots: Vec<usize>,
    children: Vec<Vec<usize>>,
}

impl Tree {
    fn new(nodes: &[Node]) -> Result<Self, IoError> {
        let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
        let mut children = Vec::with_capacity(nodes.len());
        for (parent, node) in nodes.iter().enumerate() {
            let mut own = Vec::with_capacity(node.children.len());
            for &child in &node.children {
                let path = || format!("nodes[{parent}].children");
                let place = usize::try_from(child).ok().filter(|&c| c < nodes.len());
                let Some(child) = place else {
                    return Err(no_such("node", child, nodes.len(), path()));
                };
                if let Some(other) = parents[child].replace(parent) {
                    return Err(problem(
                        path(),
                        format!(
                            "node {child} is also a child of node {other}; nodes must form trees"
                        ),
                    ));
                }
                own.push(child);
            }
            children.push(own);
        }
        let roots = (0..nodes.len()).filter(|&n| parents[n].is_none());
        Ok(Self {
            roots: roots.collect(),
            children,
        })
    }

    /// The transform of every node to the coordinates of the scene.
    fn globals(&self, nodes: &[Node], limits: &Limits) -> Result<Vec<Matrix4<f64>>, IoError> {
        let mut globals = vec![Matrix4::identity(); nodes.len()];
        let mut num_reached = 0;
        let mut stack: Vec<(usize, usize)> = self.roots.iter().map(|&root| (root, 1)).collect();
        while let Some((node, depth)) = stack.pop() {
            limits.check_depth(depth)?;
            num_reached += 1;
            // A root has the identity here, a child the transform of its parent.
            globals[node] *= local(&nodes[node]);
            for &child in &self.children[node] {
                globals[child] = globals[node];
                stack.push((child, depth + 1));
            }
        }
        if num_reached < nodes.len() {
            // Every node has one parent at most, so what no root reaches is in or behind a cycle.
            return Err(problem(
                "nodes".to_owned(),
                format!(
                    "{} nodes are their own ancestors or hang from such; nodes must form trees",
                    nodes.len() - num_reached
                ),
            ));
        }
        Ok(globals)
    }

    /// All nodes in the order in which they show their meshes.
    fn order(&self, root: &Root<'_>) -> Result<Vec<usize>, IoError> {
        let first = match root.scene {
            Some(scene) if scene >= root.scenes.len() as u64 => {
                return Err(no_such(
                    "scene",
                    scene,
                    root.scenes.len(),
                    "scene".to_owned(),
                ));
            }
            Some(scene) => scene as usize,
            None => 0,
        };
        let num_scenes = root.scenes.len();
        let others = (0..num_scenes).filter(|&scene| scene != first);
        let mut starts = Vec::new();
        for scene in (first..num_scenes).take(1).chain(others) {
            for &node in &root.scenes[scene].nodes {
                if node >= self.children.len() as u64 {
                    let path = format!("scenes[{scene}].nodes");
                    return Err(no_such("node", node, self.children.len(), path));
                }
                starts.push(node as usize);
            }
        }
        starts.extend(&self.roots);
        let mut is_done = vec![false; self.children.len()];
        let mut order = Vec::with_capacity(is_done.len());
        let mut stack = Vec::new();
        for start in starts {
            stack.push(start);
            while let Some(node) = stack.pop() {
                if std::mem::replace(&mut is_done[node], true) {
                    continue;
                }
                order.push(node);
                stack.extend(self.children[node].iter().rev());
            }
        }
        Ok(order)
    }
}

/// The transform of a node to the coordinates of its parent.
fn local(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = &node.matrix {
        return Matrix4::from_column_slice(&matrix[..]);
    }
    let mut matrix = Matrix4::identity();
    if let Some(scale) = &node.scale {
        matrix = Matrix4::new_nonuniform_scaling(&Vector3::from(**scale));
    }
    if let Some(rotation) = &node.rotation {
        let [x, y, z, w] = **rotation;
        // Rounded to 32 bits as files have them, they are of unit length only nearly.
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        matrix = rotation.to_homogeneous() * matrix;
    }
    if let Some(translation) = &node.translation {
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from_slice(&translation[..]);
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placements(text: &str) -> Result<Placements, String> {
        let text = format!(r#"{{"asset":{{"version":"2.0"}},{text}}}"#);
        let limits = Limits::default();
        let root = Root::read(&text, 0, &limits).unwrap();
        Placements::new(&root, &limits).map_err(|error| error.to_string())
    }

    const MESH: &str = r#""meshes":[{"primitives":[]}]"#;

    #[test]
    fn the_first_node_of_the_scene_places_the_mesh() {
        let nodes = r#""nodes":[
            {"mesh":0,"translation":[5,0,0]},
            {"children":[2],"scale":[2,2,2]},
            {"mesh":0,"translation":[0,1,0],"rotation":[0,0,0.7071068,0.7071068]},
            {"mesh":0}]"#;
        let at = |scenes: &str, p: [f64; 3]| {
            let found = placements(&format!("{MESH},{scenes},{nodes}")).unwrap();
            assert_eq!(found.instances, [(0, 3)]);
            let placement = &found.meshes[0];
            let q = placement.to_scene(p.into());
            assert!((placement.to_mesh(q) - Point3::from(p)).norm() < 1e-12);
            q
        };
        let q = at(r#""scenes":[{"nodes":[0]},{"nodes":[1]}]"#, [1.0, 0.0, 0.0]);
        assert_eq!(q, Point3::new(6.0, 0.0, 0.0));
        let q = at(
            r#""scene":1,"scenes":[{"nodes":[0]},{"nodes":[1]}]"#,
            [1.0, 0.0, 0.0],
        );
        assert!((q - Point3::new(0.0, 4.0, 0.0)).norm() < 1e-12, "{q}");
        let q = at(r#""scenes":[]"#, [1.0, 0.0, 0.0]);
        assert_eq!(q, Point3::new(6.0, 0.0, 0.0));
    }

    #[test]
    fn a_skin_a_mirror_and_a_singular_matrix() {
        let of = |node: &str| {
            placements(&format!(
                r#"{MESH},"skins":[{{"joints":[0]}}],"nodes":[{node}]"#
            ))
            .unwrap()
        };
        let skinned = of(r#"{"mesh":0,"skin":0,"scale":[2,2,2]}"#);
        assert_eq!(skinned.meshes[0], Placement::default());
        let mirrored = of(r#"{"mesh":0,"scale":[-1,2,1]}"#);
        assert!(mirrored.meshes[0].is_mirrored);
        let n = Vector3::new(1.0, 1.0, 0.0);
        let turned = mirrored.meshes[0].normal_to_scene(n);
        assert!(
            (turned.norm() - n.norm()).abs() < 1e-12 && turned.x < 0.0,
            "{turned}"
        );
        assert!((mirrored.meshes[0].normal_to_mesh(turned) - n).norm() < 1e-12);
        for singular in [
            r#"{"mesh":0,"scale":[1,0,1]}"#,
            r#"{"mesh":0,"scale":[1,1e300,1e300]}"#,
            r#"{"mesh":0,"matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}"#,
        ] {
            assert_eq!(of(singular).singular, [0], "{singular}");
        }
    }

    #[test]
    fn nodes_that_are_no_trees_are_refused() {
        let refused = |nodes: &str| placements(&format!("{MESH},{nodes}")).unwrap_err();
        let error = refused(r#""nodes":[{"children":[1]},{"children":[0]}]"#);
        assert!(
            error.starts_with("nodes: 2 nodes are their own ancestors"),
            "{error}"
        );
        let error = refused(r#""nodes":[{"children":[0]}]"#);
        assert!(error.starts_with("nodes: 1 nodes"), "{error}");
        let error = refused(r#""nodes":[{"children":[1,1]},{}]"#);
        assert!(
            error.contains("node 1 is also a child of node 0"),
            "{error}"
        );
        let error = refused(r#""nodes":[{"children":[4294967296]}]"#);
        assert!(
            error.contains("there is no node 4294967296; there are 1"),
            "{error}"
        );
        let error = refused(r#""scene":3"#);
        assert!(error.starts_with("scene: there is no scene 3"), "{error}");
        let error = refused(r#""nodes":[{"mesh":1}]"#);
        assert!(
            error.starts_with("nodes[0].mesh: there is no mesh 1"),
            "{error}"
        );
        // A long chain is refused by its depth, and no stack overflows.
        let chain: Vec<String> = (1..100_000)
            .map(|n| format!(r#"{{"children":[{n}]}}"#))
            .collect();
        let error = refused(&format!(r#""nodes":[{},{{}}]"#, chain.join(",")));
        assert!(error.contains("128 levels of nesting"), "{error}");
    }
}
