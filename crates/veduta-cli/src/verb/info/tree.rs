//! Objects by the tree of their names.

use crate::talk::{grouped, plain};
use std::collections::HashMap;
use std::fmt::Write;
use veduta::scene::Scene;

/// Lines of the tree that are shown unless all are asked for.
const USUAL_LINES: usize = 60;

/// A step of a path of names.
#[derive(Default)]
struct Node<'a> {
    name: &'a str,
    objects: usize,
    /// Of the objects in it and below.
    faces: usize,
    /// In the order of the file.
    children: Vec<Node<'a>>,
    /// Where in `children` a name stands; never walked through.
    rows: HashMap<&'a str, usize>,
}

impl<'a> Node<'a> {
    fn add(&mut self, path: &'a str, faces: usize) {
        self.objects += 1;
        self.faces += faces;
        let (name, rest) = match path.split_once('/') {
            Some((name, rest)) => (name, Some(rest)),
            None => (path, None),
        };
        let row = *self.rows.entry(name).or_insert(self.children.len());
        if row == self.children.len() {
            self.children.push(Node {
                name,
                ..Node::default()
            });
        }
        match rest {
            Some(rest) => self.children[row].add(rest, faces),
            None => {
                self.children[row].objects += 1;
                self.children[row].faces += faces;
            }
        }
    }

    fn write(&self, depth: usize, lines: &mut Vec<String>) {
        for child in &self.children {
            // A step with one only below it takes no line of its own.
            let (mut name, mut node) = (plain(child.name), child);
            while let [only] = node.children.as_slice()
                && only.objects == node.objects
            {
                write!(name, "/{}", plain(only.name)).expect("strings grow");
                node = only;
            }
            let indent = 4 + 2 * depth;
            let width = 44usize.saturating_sub(indent);
            let faces = grouped(node.faces);
            let mut line = format!("{:indent$}{name:width$}  {faces:>11} faces", "");
            if node.objects > 1 {
                write!(line, " in {} objects", grouped(node.objects)).expect("strings grow");
            }
            lines.push(line);
            node.write(depth + 1, lines);
        }
    }
}

/// Appends the tree of the scene's objects.
pub fn write(scene: &Scene, all: bool, text: &mut String) {
    let mut root = Node::default();
    for (index, object) in scene.objects.iter().enumerate() {
        root.add(&object.name, faces(scene, index));
    }
    let mut lines = Vec::new();
    root.write(0, &mut lines);
    let shown = if all { lines.len() } else { USUAL_LINES };
    for line in lines.iter().take(shown) {
        text.push_str(line);
        text.push('\n');
    }
    if lines.len() > shown {
        let rest = grouped(lines.len() - shown);
        writeln!(text, "    … and {rest} lines more; --all shows them").expect("strings grow");
    }
}

/// Faces of the object in row `index`.
pub fn faces(scene: &Scene, index: usize) -> usize {
    scene.meshes[scene.objects[index].mesh.0 as usize].face_count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::map::MaterialId;
    use veduta::scene::{Mesh, MeshId, Object};
    use veduta_geometry::{DMat4, DVec3};

    #[test]
    fn names_make_a_tree_with_sums() {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2], [2, 1, 0]],
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        };
        let object = |name: &str| Object {
            name: name.into(),
            mesh: MeshId(0),
            world_from_object: DMat4::IDENTITY,
        };
        let scene = Scene {
            objects: [
                "town/house/roof",
                "town/house/wall",
                "town/tree",
                "town",
                "a/b/c\u{1b}[2J",
            ]
            .map(object)
            .to_vec(),
            meshes: vec![mesh],
            ..Scene::default()
        };
        let mut text = String::new();
        write(&scene, false, &mut text);
        let rows: Vec<Vec<&str>> = text
            .lines()
            .map(|line| line.split_whitespace().collect())
            .collect();
        assert_eq!(
            rows,
            [
                vec!["town", "8", "faces", "in", "4", "objects"],
                vec!["house", "4", "faces", "in", "2", "objects"],
                vec!["roof", "2", "faces"],
                vec!["wall", "2", "faces"],
                vec!["tree", "2", "faces"],
                vec!["a/b/c\\u{1b}[2J", "2", "faces"],
            ]
        );
    }
}
