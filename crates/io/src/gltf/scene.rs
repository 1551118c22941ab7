//! The placement of meshes by nodes.
//!
//! Source: glTF 2.0 specification, sections 3.5.2 "Nodes and Hierarchy" and 3.7.3 "Skins";
//! Khronos, "EXT_mesh_gpu_instancing".

use std::collections::HashSet;

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::Buffers;
use super::accessor::{Layout, no_such, problem};
use super::model::{Instancing, Node, Root};
use crate::error::IoError;
use crate::limits::Limits;
use crate::parsed;
use crate::placement::Placement;

/// The placement of each mesh.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Placements {
    /// The placement per mesh; the identity for a mesh that no node shows.
    pub(super) meshes: Vec<Placement>,
    /// Meshes with only singular transforms, which are read as if they had none.
    pub(super) singular: Vec<usize>,
    /// The other instances per mesh.
    pub(super) others: Vec<Others>,
    /// All nodes, in file order.
    pub(super) nodes: Vec<parsed::Node>,
}

/// The instances of a mesh in addition to the one where it was read.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Others {
    /// The total number of its instances.
    pub(super) count: usize,
    shown: Vec<Shown>,
    /// The entry of `shown` where it was read.
    first: usize,
    /// The number of its instances that only scenes other than the default one show.
    pub(super) elsewhere: usize,
}

/// A node that shows a mesh.
#[derive(Clone, PartialEq, Debug)]
struct Shown {
    node: usize,
    transform: Matrix4<f64>,
    instancing: Option<Box<Layouts>>,
}

/// The accessors of the transforms of instances.
#[derive(Clone, PartialEq, Debug)]
struct Layouts {
    count: usize,
    translation: Option<Layout>,
    rotation: Option<Layout>,
    scale: Option<Layout>,
}

impl Placements {
    /// Places each mesh according to the first node that shows it with an invertible transform:
    /// first the nodes of the default scene, depth first, then those of the other scenes, then
    /// the rest.
    pub(super) fn new(
        root: &Root<'_>,
        buffers: &Buffers,
        limits: &Limits,
    ) -> Result<Self, IoError> {
        let nodes = &root.nodes;
        let tree = Tree::new(nodes)?;
        let globals = tree.globals(nodes, limits)?;
        let mut all: Vec<Others> = vec![Others::default(); root.meshes.len()];
        let (order, num_displayed) = tree.order(root)?;
        for (place, node) in order.into_iter().enumerate() {
            let Some(mesh) = nodes[node].mesh else {
                continue;
            };
            let number = usize::try_from(mesh).ok();
            let Some(others) = number.and_then(|mesh| all.get_mut(mesh)) else {
                let path = format!("nodes[{node}].mesh");
                return Err(no_such("mesh", mesh, root.meshes.len(), path));
            };
            let shown = Shown::new(node, &globals[node], root, buffers)?;
            others.count = others.count.saturating_add(shown.count());
            if place >= num_displayed && !others.shown.is_empty() && num_displayed > 0 {
                others.elsewhere = others.elsewhere.saturating_add(shown.count());
            } else {
                others.shown.push(shown);
            }
        }
        let mut meshes = Vec::with_capacity(all.len());
        let mut singular = Vec::new();
        for (mesh, others) in all.iter_mut().enumerate() {
            let mut first = None;
            for (number, shown) in others.shown.iter().enumerate() {
                let matrix = shown.transform(0, buffers);
                if let Some(placement) = matrix.and_then(|matrix| Placement::new(&matrix)) {
                    first = Some((number, placement));
                    break;
                }
            }
            if first.is_none() && others.count > 0 {
                singular.push(mesh);
            }
            let (number, placement) = first.unwrap_or_default();
            others.first = number;
            meshes.push(placement);
        }
        Ok(Self {
            meshes,
            singular,
            others: all,
            nodes: named(root, &tree),
        })
    }
}

impl Others {
    /// Visits the placement of each additional instance that is invertible, and returns the
    /// number of those that are not.
    ///
    /// Instances at the same place as an earlier one are skipped.
    pub(super) fn for_each(
        &self,
        buffers: &Buffers,
        mut place: impl FnMut(&Placement) -> Result<(), IoError>,
    ) -> Result<usize, IoError> {
        let mut num_singular = 0;
        let mut seen: HashSet<[u64; 16]> = HashSet::new();
        let first = self.shown.get(self.first);
        let first = first.filter(|first| first.instancing.is_none());
        let mut is_new = |matrix: &Matrix4<f64>| {
            let mut bits = [0; 16];
            // Negative and positive zero are the same place.
            bits.iter_mut()
                .zip(matrix)
                .for_each(|(bits, x)| *bits = (x + 0.0).to_bits());
            seen.insert(bits)
        };
        if let Some(first) = first.and_then(|first| first.transform(0, buffers)) {
            is_new(&first);
        }
        for (number, shown) in self.shown.iter().enumerate() {
            let start = usize::from(number == self.first);
            for instance in start..shown.count() {
                let Some(matrix) = shown.transform(instance, buffers) else {
                    continue;
                };
                if shown.instancing.is_none() && !is_new(&matrix) {
                    continue;
                }
                match Placement::new(&matrix) {
                    Some(placement) => place(&placement)?,
                    None => num_singular += 1,
                }
            }
        }
        Ok(num_singular)
    }

    /// The nodes of the displayed scene that show the mesh, except for the one where it was read.
    pub(super) fn further_nodes(&self) -> impl Iterator<Item = usize> {
        let shown = self.shown.iter().enumerate();
        let further = shown.filter(|(number, _)| *number != self.first);
        further.map(|(_, shown)| shown.node)
    }

    /// Upper bound on the number of additional instances.
    pub(super) fn num_places(&self) -> usize {
        let counts = self.shown.iter().map(Shown::count);
        let all = counts.fold(0, usize::saturating_add);
        all.saturating_sub(1)
    }
}

impl Shown {
    fn new(
        node: usize,
        global: &Matrix4<f64>,
        root: &Root<'_>,
        buffers: &Buffers,
    ) -> Result<Self, IoError> {
        let extensions = root.nodes[node].extensions.as_deref();
        let instancing = extensions.and_then(|extensions| extensions.instancing.as_ref());
        let instancing = instancing
            .map(|instancing| Layouts::new(node, instancing, root, buffers).map(Box::new))
            .transpose()?;
        // A skinned mesh is placed by its joints.
        let is_skinned = root.nodes[node].skin.is_some();
        Ok(Self {
            node,
            transform: match is_skinned {
                true => Matrix4::identity(),
                false => *global,
            },
            instancing: instancing.filter(|_| !is_skinned),
        })
    }

    /// The number of times that the node shows its mesh.
    fn count(&self) -> usize {
        self.instancing.as_ref().map_or(1, |layouts| layouts.count)
    }

    /// The transform from mesh coordinates to scene coordinates.
    fn transform(&self, instance: usize, buffers: &Buffers) -> Option<Matrix4<f64>> {
        match &self.instancing {
            None => Some(self.transform),
            Some(layouts) if instance < layouts.count => {
                Some(self.transform * layouts.transform(instance, buffers))
            }
            Some(_) => None,
        }
    }
}

impl Layouts {
    fn new(
        node: usize,
        instancing: &Instancing,
        root: &Root<'_>,
        buffers: &Buffers,
    ) -> Result<Self, IoError> {
        let path = |name: &str| {
            format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes.{name}")
        };
        let layout = |name: &str, components: usize| {
            let Some(&accessor) = instancing.attributes.get(name) else {
                return Ok(None);
            };
            let layout = Layout::new(accessor, &root.accessors, &root.views, buffers)?;
            match layout.components == components {
                true => Ok(Some(layout)),
                false => Err(problem(
                    path(name),
                    format!("it has {} numbers and not {components}", layout.components),
                )),
            }
        };
        let translation = layout("TRANSLATION", 3)?;
        let rotation = layout("ROTATION", 4)?;
        let scale = layout("SCALE", 3)?;
        let layouts = [&translation, &rotation, &scale];
        let counts = layouts.into_iter().flatten().map(|layout| layout.count);
        let mut counts = counts.collect::<Vec<_>>().into_iter();
        // Other attributes, such as colours, have the same number of elements.
        let count = match counts.next() {
            Some(count) => count,
            None => instancing.attributes.values().next().map_or(Ok(1), |&a| {
                Layout::new(a, &root.accessors, &root.views, buffers).map(|layout| layout.count)
            })?,
        };
        if let Some(other) = counts.find(|&other| other != count) {
            return Err(problem(
                path("*"),
                format!("there are {count} instances by one attribute and {other} by another"),
            ));
        }
        Ok(Self {
            count,
            translation,
            rotation,
            scale,
        })
    }

    fn transform(&self, instance: usize, buffers: &Buffers) -> Matrix4<f64> {
        let vector = |layout: &Option<Layout>| {
            let layout = layout.as_ref()?;
            let bytes = layout.element(buffers, instance);
            Some([0, 1, 2, 3].map(|k| match k < layout.components {
                true => layout.value(&bytes, k),
                false => 0.0,
            }))
        };
        let xyz = |[x, y, z, _]: [f64; 4]| Box::new([x, y, z]);
        composed(
            vector(&self.translation).map(xyz).as_deref(),
            vector(&self.rotation).as_ref(),
            vector(&self.scale).map(xyz).as_deref(),
        )
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

    /// The transform of every node to scene coordinates.
    fn globals(&self, nodes: &[Node], limits: &Limits) -> Result<Vec<Matrix4<f64>>, IoError> {
        let mut globals = vec![Matrix4::identity(); nodes.len()];
        let mut num_reached = 0;
        let mut stack: Vec<(usize, usize)> = self.roots.iter().map(|&root| (root, 1)).collect();
        while let Some((node, depth)) = stack.pop() {
            limits.check_depth(depth)?;
            num_reached += 1;
            // Initially the identity for a root, and the parent's transform for a child.
            globals[node] *= local(&nodes[node]);
            for &child in &self.children[node] {
                globals[child] = globals[node];
                stack.push((child, depth + 1));
            }
        }
        if num_reached < nodes.len() {
            // Every node has at most one parent, so nodes unreachable from a root are in or below
            // a cycle.
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

    /// All nodes in the order in which they show their meshes, and the number of those in the
    /// default scene.
    fn order(&self, root: &Root<'_>) -> Result<(Vec<usize>, usize), IoError> {
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
        let (mut starts, mut num_first) = (Vec::new(), 0);
        for scene in (first..num_scenes).take(1).chain(others) {
            for &node in &root.scenes[scene].nodes {
                if node >= self.children.len() as u64 {
                    let path = format!("scenes[{scene}].nodes");
                    return Err(no_such("node", node, self.children.len(), path));
                }
                starts.push(node as usize);
            }
            if scene == first {
                num_first = starts.len();
            }
        }
        starts.extend(&self.roots);
        let mut is_done = vec![false; self.children.len()];
        let mut order = Vec::with_capacity(is_done.len());
        let (mut stack, mut num_displayed) = (Vec::new(), 0);
        for (number, start) in starts.into_iter().enumerate() {
            stack.push(start);
            while let Some(node) = stack.pop() {
                if std::mem::replace(&mut is_done[node], true) {
                    continue;
                }
                order.push(node);
                stack.extend(self.children[node].iter().rev());
            }
            if number < num_first {
                num_displayed = order.len();
            }
        }
        Ok((order, num_displayed))
    }
}

/// The nodes with their names, parents and meshes.
fn named(root: &Root<'_>, tree: &Tree) -> Vec<parsed::Node> {
    let node = |node: &Node| parsed::Node {
        name: node.name.as_deref().unwrap_or_default().to_owned(),
        parent: None,
        part: node.mesh.and_then(|mesh| usize::try_from(mesh).ok()),
    };
    let mut nodes: Vec<parsed::Node> = root.nodes.iter().map(node).collect();
    for (parent, children) in tree.children.iter().enumerate() {
        children
            .iter()
            .for_each(|&child| nodes[child].parent = Some(parent));
    }
    nodes
}

/// The transform of a node to the coordinates of its parent.
fn local(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = &node.matrix {
        return Matrix4::from_column_slice(&matrix[..]);
    }
    composed(
        node.translation.as_deref(),
        node.rotation.as_deref(),
        node.scale.as_deref(),
    )
}

/// Scale, then rotation, then translation.
fn composed(
    translation: Option<&[f64; 3]>,
    rotation: Option<&[f64; 4]>,
    scale: Option<&[f64; 3]>,
) -> Matrix4<f64> {
    let mut matrix = Matrix4::identity();
    if let Some(scale) = scale {
        matrix = Matrix4::new_nonuniform_scaling(&Vector3::from(*scale));
    }
    if let Some(&[x, y, z, w]) = rotation {
        // Rounded to 32 bits in files, quaternions have only approximately unit length.
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        matrix = rotation.to_homogeneous() * matrix;
    }
    if let Some(translation) = translation {
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from_slice(&translation[..]);
    }
    matrix
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    fn placements(text: &str) -> Result<Placements, String> {
        let text = format!(r#"{{"asset":{{"version":"2.0"}},{text}}}"#);
        let limits = Limits::default();
        let root = Root::read(&text, 0, &limits).unwrap();
        let buffers = Buffers {
            file: Vec::new(),
            list: Vec::new(),
            external: 0,
        };
        Placements::new(&root, &buffers, &limits).map_err(|error| error.to_string())
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
            assert_eq!(found.others[0].count, 3);
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
        // A long chain is rejected by its depth, without a stack overflow.
        let chain: Vec<String> = (1..100_000)
            .map(|n| format!(r#"{{"children":[{n}]}}"#))
            .collect();
        let error = refused(&format!(r#""nodes":[{},{{}}]"#, chain.join(",")));
        assert!(error.contains("128 levels of nesting"), "{error}");
    }
}
