use super::Group;
use super::join::{Region, polygon_of};
use crate::scene::Scene;
use std::collections::BTreeMap;
use veduta_geometry::{DVec2, signed_area};
use veduta_map::VisibilityMap;

/// What is painted when.
pub(super) struct Painting {
    pub groups: Vec<Group>,
    /// Regions in the order in which they are painted.
    pub order: Vec<u32>,
    /// The group of each of `order`.
    pub group_of: Vec<u32>,
}

/// A node of the tree of names, with all that is seen of it.
#[derive(Default)]
struct Node<'a> {
    name: &'a str,
    children: BTreeMap<&'a str, usize>,
    regions: Vec<u32>,
    nearness: Mean,
}

/// A mean over areas.
#[derive(Clone, Copy, Default)]
struct Mean {
    area: f64,
    sum: f64,
}

impl Mean {
    fn add(&mut self, other: Mean) {
        self.area += other.area;
        self.sum += other.sum;
    }

    fn value(self) -> f64 {
        self.sum / self.area
    }
}

/// Levels of the tree. What is deeper keeps the slashes in its name: programs that read files nest only so
/// deep.
const MOST_LEVELS: usize = 64;

/// Puts the objects' names into a tree, the farther of its branches first: by the mean nearness of what
/// is seen. Of one object the thin regions come first.
pub(super) fn painting(
    scene: &Scene,
    map: &VisibilityMap,
    regions: &[Region],
    thickness: &[f64],
) -> Painting {
    let nearness: Vec<Mean> = regions.iter().map(|region| mean(map, region)).collect();
    let mut nodes = vec![Node::default()];
    for (index, region) in regions.iter().enumerate() {
        let object = map.faces.object(region.faces[0]);
        let mut at = 0;
        nodes[at].nearness.add(nearness[index]);
        for name in scene.object(object).name.splitn(MOST_LEVELS, '/') {
            at = match nodes[at].children.get(name) {
                Some(&child) => child,
                None => {
                    let child = nodes.len();
                    nodes.push(Node {
                        name,
                        ..Node::default()
                    });
                    nodes[at].children.insert(name, child);
                    child
                }
            };
            nodes[at].nearness.add(nearness[index]);
        }
        nodes[at].regions.push(index as u32);
    }

    let mut painting = Painting {
        groups: Vec::new(),
        order: Vec::new(),
        group_of: Vec::new(),
    };
    // Nodes whose groups are still to be made, the next one last.
    let mut open: Vec<(usize, Option<u32>)> = vec![(0, None)];
    while let Some((at, parent)) = open.pop() {
        let node = &nodes[at];
        let own = (at != 0).then_some(painting.groups.len() as u32);
        if let Some(own) = own {
            let start = painting.order.len();
            let mut thin_to_thick = node.regions.clone();
            let key = |region: &u32| thickness[*region as usize];
            thin_to_thick.sort_by(|a, b| key(a).total_cmp(&key(b)));
            painting.group_of.extend(thin_to_thick.iter().map(|_| own));
            painting.order.extend(thin_to_thick);
            painting.groups.push(Group {
                name: node.name.to_owned(),
                parent,
                shapes: start..painting.order.len(),
            });
        }
        let mut children: Vec<usize> = node.children.values().copied().collect();
        let key = |child: &usize| nodes[*child].nearness.value();
        children.sort_by(|a, b| key(b).total_cmp(&key(a)));
        open.extend(children.into_iter().map(|child| (child, own)));
    }
    painting
}

fn mean(map: &VisibilityMap, region: &Region) -> Mean {
    let mut mean = Mean::default();
    for &fragment in &region.fragments {
        let polygon = polygon_of(map, fragment);
        let plane = map.faces.face_nearness(map.opaque.face(fragment as usize));
        let area = signed_area(polygon);
        let middle = polygon.iter().sum::<DVec2>() / polygon.len() as f64;
        mean.add(Mean {
            area,
            sum: area * plane.at(middle),
        });
    }
    mean
}
