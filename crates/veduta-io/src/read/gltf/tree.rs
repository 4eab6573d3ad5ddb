//! The node tree: which node stands where, and what it is called.

use super::animation::Posed;
use super::document::{Document, Index, Node};
use super::{Fault, Problem, row};
use crate::read::budget::Budget;
use crate::read::names::unique;
use std::collections::HashMap;
use veduta_geometry::{DMat3, DMat4, DQuat, DVec3, DVec4};

/// The nodes that the scene shows.
pub struct Tree {
    /// In tree order: each node before its children.
    pub placed: Vec<Placed>,
    /// For each node of the document: its row in `placed`.
    places: Vec<Option<u32>>,
    /// For each node of the document: its parent.
    parents: Vec<Option<usize>>,
    /// For each node of the document: a name that no sibling has.
    labels: Vec<String>,
}

/// A node in its place.
pub struct Placed {
    pub node: usize,
    pub world_from_node: DMat4,
}

impl Tree {
    /// Walks the tree of the document's scene, or of all nodes if it has no scene.
    ///
    /// Nodes stand as `posed` says, else as their own transforms say. Trees may be as deep as memory
    /// allows: nothing here recurses.
    pub fn grow(document: &Document, posed: &Posed, budget: &mut Budget) -> Result<Self, Fault> {
        let nodes = &document.nodes;
        let parents = parents(nodes)?;
        refuse_cycles(nodes, &parents)?;
        let roots = roots(document, &parents)?;

        let mut labels = vec![String::new(); nodes.len()];
        label_siblings(document, roots.iter().copied(), &mut labels, budget)?;
        let mut placed = Vec::new();
        let mut places = vec![None; nodes.len()];
        let mut waiting: Vec<(usize, DMat4)> = roots
            .iter()
            .rev()
            .map(|&root| (root, DMat4::IDENTITY))
            .collect();
        while let Some((node, world_from_parent)) = waiting.pop() {
            let world_from_node = world_from_parent * local_transform(node, &nodes[node], posed)?;
            places[node] = Some(placed.len() as u32);
            placed.push(Placed {
                node,
                world_from_node,
            });
            let children = || nodes[node].children.iter().map(|&child| child as usize);
            label_siblings(document, children(), &mut labels, budget)?;
            waiting.extend(children().rev().map(|child| (child, world_from_node)));
        }
        Ok(Self {
            placed,
            places,
            parents,
            labels,
        })
    }

    /// Where a node stands; `None` if the scene does not show it.
    pub fn world_from(&self, node: usize) -> Option<DMat4> {
        let place = self.places[node]?;
        Some(self.placed[place as usize].world_from_node)
    }

    /// The names of a node's children, as [`unique`] wants them.
    pub fn children_of(&self, document: &Document, node: usize) -> HashMap<String, u32> {
        let children = document.nodes[node].children.iter();
        let label = |&child: &Index| (self.labels[child as usize].clone(), 1);
        children.map(label).collect()
    }

    /// The names from the root to `node`, joined by `/`; unique in the scene.
    ///
    /// Long paths of deep trees are charged to the budget, since together they grow as the square
    /// of the file.
    pub fn path(&self, node: usize, budget: &mut Budget) -> Result<String, Problem> {
        let ancestry = || std::iter::successors(Some(node), |&node| self.parents[node]);
        let length: usize = ancestry().map(|node| self.labels[node].len() + 1).sum();
        budget.charge(length as u64, 2)?;
        let mut labels: Vec<&str> = ancestry().map(|node| self.labels[node].as_str()).collect();
        labels.reverse();
        Ok(labels.join("/"))
    }
}

/// Each node's parent; an error where a child does not exist or has two.
fn parents(nodes: &[Node]) -> Result<Vec<Option<usize>>, Fault> {
    let mut parents = vec![None; nodes.len()];
    for (parent, node) in nodes.iter().enumerate() {
        for (at, &child) in node.children.iter().enumerate() {
            let at = || format!("nodes[{parent}].children[{at}]");
            let (child, _) = row(nodes, child, "node", &at())?;
            if let Some(first) = parents[child].replace(parent) {
                let parent = format!("nodes[{first}]");
                let node = child;
                return Err(Problem::PlacedTwice { node, parent }.at_json(at()));
            }
        }
    }
    Ok(parents)
}

/// An error where following parents from a node leads back to it.
fn refuse_cycles(nodes: &[Node], parents: &[Option<usize>]) -> Result<(), Fault> {
    // The node from which each one was first visited on the way up.
    let mut visitor = vec![usize::MAX; nodes.len()];
    for start in 0..nodes.len() {
        let mut node = start;
        while visitor[node] == usize::MAX {
            visitor[node] = start;
            match parents[node] {
                Some(parent) if visitor[parent] == start => {
                    return Err(Problem::Cycle.at_json(format!("nodes[{parent}]")));
                }
                Some(parent) => node = parent,
                None => break,
            }
        }
    }
    Ok(())
}

/// The nodes at the top of the scene.
fn roots(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>, Fault> {
    let Some(index) = document
        .scene
        .or((!document.scenes.is_empty()).then_some(0))
    else {
        return Ok((0..parents.len())
            .filter(|&node| parents[node].is_none())
            .collect());
    };
    let (index, scene) = row(&document.scenes, index, "scene", "scene")?;
    let mut is_root = vec![false; parents.len()];
    let mut roots = Vec::with_capacity(scene.nodes.len());
    for (at, &root) in scene.nodes.iter().enumerate() {
        let at = format!("scenes[{index}].nodes[{at}]");
        let (node, _) = row(&document.nodes, root, "node", &at)?;
        let parent = match parents[node] {
            Some(parent) => Some(format!("nodes[{parent}]")),
            None => is_root[node].then(|| "the scene".to_owned()),
        };
        if let Some(parent) = parent {
            return Err(Problem::PlacedTwice { node, parent }.at_json(at));
        }
        is_root[node] = true;
        roots.push(node);
    }
    Ok(roots)
}

/// Gives siblings names that differ: `wheel`, `wheel#2`, `wheel#3`.
fn label_siblings(
    document: &Document,
    siblings: impl Iterator<Item = usize>,
    labels: &mut [String],
    budget: &mut Budget,
) -> Result<(), Fault> {
    let mut seen: HashMap<String, u32> = HashMap::new();
    for node in siblings {
        let row = &document.nodes[node];
        let mesh = row
            .mesh
            .and_then(|mesh| document.meshes.get(usize::try_from(mesh).ok()?));
        let name = [
            row.name.as_deref(),
            mesh.and_then(|mesh| mesh.name.as_deref()),
        ]
        .into_iter()
        .flatten()
        .find(|name| !name.is_empty());
        // A long name of a mesh may be repeated by many nodes.
        let charged = budget.charge(name.map_or(0, str::len) as u64, 2);
        charged.map_err(|problem| problem.at_json(format!("nodes[{node}]")))?;
        // A slash within a name would look like two names.
        let name = name.map_or_else(|| format!("node{node}"), |name| name.replace('/', "_"));
        labels[node] = unique(name, &mut seen);
    }
    Ok(())
}

/// A node's own transform (glTF 2.0, §3.5.3), or what an animation puts in its place.
fn local_transform(index: usize, node: &Node, posed: &Posed) -> Result<DMat4, Fault> {
    let illegal = |field: &str, found: String, expected: &'static str| {
        Problem::Illegal { found, expected }.at_json(format!("nodes[{index}].{field}"))
    };
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(matrix);
        let last_row = matrix.row(3);
        // Exporters that compute in f32 leave some dust there.
        if !last_row.abs_diff_eq(DVec4::W, 1e-6) {
            let found = format!("a matrix whose last row is {last_row}");
            return Err(illegal("matrix", found, "[0, 0, 0, 1] there"));
        }
        return Ok(DMat4::from_mat3_translation(
            DMat3::from_mat4(matrix),
            matrix.w_axis.truncate(),
        ));
    }
    let rotation = match node.rotation {
        None => DQuat::IDENTITY,
        Some(components) => {
            let quaternion = DQuat::from_array(components);
            let length = quaternion.length();
            if !(length > 0.0 && length.is_finite()) {
                let found = format!("{components:?}");
                return Err(illegal("rotation", found, "a quaternion of length 1"));
            }
            quaternion / length
        }
    };
    let posed = posed.node(index);
    let own = node.scale.map_or(DVec3::ONE, DVec3::from_array);
    let scale = posed.and_then(|posed| posed.scale).unwrap_or(own);
    let rotation = posed.and_then(|posed| posed.rotation).unwrap_or(rotation);
    let own = node.translation.map_or(DVec3::ZERO, DVec3::from_array);
    let translation = posed.and_then(|posed| posed.translation).unwrap_or(own);
    Ok(DMat4::from_scale_rotation_translation(
        scale,
        rotation,
        translation,
    ))
}
