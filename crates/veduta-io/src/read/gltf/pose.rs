//! How a mesh stands: its morph targets and its skin.
//!
//! glTF 2.0, §3.7.2.2 and §3.7.3. Targets have the shares that they are given, and joints stand where the
//! node tree puts them: what moves both is known before. What is posed is a mesh of its own.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::document::Document;
use super::material::TexcoordSets;
use super::primitive::{VERTICES_PER_TASK, Vertices};
use super::tree::Tree;
use super::{Fault, Problem, row};
use crate::read::budget::Budget;
use rayon::prelude::*;
use veduta::scene::Mesh;
use veduta_geometry::{DMat3, DMat4, DVec3, Vec2, Vec3};

/// How a mesh stands.
#[derive(Clone, Copy, Default)]
pub struct Pose<'a> {
    /// Shares of the morph targets; those that are absent are 0.
    pub weights: &'a [f32],
    /// What bends it.
    pub skin: Option<&'a Skin>,
}

/// The joints that bend a mesh, in their places.
pub struct Skin {
    /// From where a joint held the mesh when they were bound, to the world.
    world_from_bind: Vec<DMat4>,
}

impl Skin {
    /// Reads the skin in row `index` of the document.
    pub fn read(
        document: &Document,
        buffers: &Buffers<'_>,
        tree: &Tree,
        index: usize,
        budget: &mut Budget,
    ) -> Result<Self, Fault> {
        let skin = &document.skins[index];
        let at = format!("skins[{index}]");
        let charge = budget.charge(skin.joints.len() as u64, size_of::<[DMat4; 2]>());
        charge.map_err(|problem| problem.at_json(&at))?;
        let bind = match skin.inverse_bind_matrices {
            None => Vec::new(),
            Some(accessor) => {
                let at = format!("{at}.inverseBindMatrices");
                let elements = Elements::find(document, buffers, accessor, "MAT4", &at)?;
                if elements.count < skin.joints.len() as u64 {
                    return Err(Problem::Illegal {
                        found: format!("{} matrices", elements.count),
                        expected: "one for each joint",
                    }
                    .at_json(at));
                }
                let rows: Vec<u32> = (0..skin.joints.len() as u32).collect();
                elements.vectors(Some(&rows), |m: [f32; 16]| {
                    DMat4::from_cols_array(&m.map(f64::from))
                })
            }
        };
        let mut world_from_bind = Vec::with_capacity(skin.joints.len());
        for (number, &joint) in skin.joints.iter().enumerate() {
            let at = format!("{at}.joints[{number}]");
            let (node, _) = row(&document.nodes, joint, "node", &at)?;
            let Some(world_from_joint) = tree.world_from(node) else {
                let found = format!("node {node}, which the scene does not show");
                let expected = "a node of the scene";
                return Err(Problem::Illegal { found, expected }.at_json(at));
            };
            world_from_bind.push(match bind.get(number) {
                Some(joint_from_bind) => world_from_joint * *joint_from_bind,
                None => world_from_joint,
            });
        }
        Ok(Self { world_from_bind })
    }
}

impl Vertices<'_, '_> {
    /// Adds the shares of the morph targets to a mesh's attributes.
    pub fn morph(
        &mut self,
        mesh: &mut Mesh,
        weights: &[f32],
        sets: &TexcoordSets,
    ) -> Result<(), Fault> {
        let targets = self.primitive.targets.len();
        for (target, &weight) in weights.iter().enumerate().take(targets) {
            if weight == 0.0 {
                continue;
            }
            if let Some(added) = self.difference(target, "POSITION", "VEC3", 12)? {
                let weight = f64::from(weight);
                let share = |d: [f32; 3]| DVec3::from_array(d.map(f64::from)) * weight;
                for (position, share) in mesh
                    .positions
                    .iter_mut()
                    .zip(added.vectors(self.rows, share))
                {
                    *position += share;
                }
            }
            if !mesh.normals.is_empty()
                && let Some(added) = self.difference(target, "NORMAL", "VEC3", 12)?
            {
                let shares = added.vectors(self.rows, |d| Vec3::from_array(d) * weight);
                for (normal, share) in mesh.normals.iter_mut().zip(shares) {
                    *normal += share;
                }
            }
            let tables = [
                (Some(sets.first), &mut mesh.texcoords),
                (sets.second, &mut mesh.second_texcoords),
            ];
            for (set, texcoords) in tables {
                let Some(set) = set.filter(|_| !texcoords.is_empty()) else {
                    continue;
                };
                let name = format!("TEXCOORD_{set}");
                if let Some(added) = self.difference(target, &name, "VEC2", 8)? {
                    let shares = added.vectors(self.rows, |d| Vec2::from_array(d) * weight);
                    for (uv, share) in texcoords.iter_mut().zip(shares) {
                        *uv += share;
                    }
                }
            }
            if !mesh.colors.is_empty()
                && let Some(added) = self.difference(target, "COLOR_0", "VEC3 or VEC4", 16)?
            {
                add_colors(mesh, &added, weight, self.rows);
            }
        }
        Ok(())
    }

    /// Bends a mesh by its joints. It is in world space afterwards, where the node that shows it is of
    /// no account.
    pub fn bend(&mut self, mesh: &mut Mesh, skin: &Skin) -> Result<(), Fault> {
        let mut influences = Vec::new();
        for set in 0.. {
            let name = format!("JOINTS_{set}");
            let Some(joints) = self.attribute(&name, "VEC4", 16)? else {
                break;
            };
            let at = format!("{}.attributes", self.at);
            if !joints.is_unsigned_integer() {
                let found = "an accessor of signed numbers or fractions".to_owned();
                let expected = "unsigned integers";
                let problem = Problem::Illegal { found, expected };
                return Err(problem.at_json(format!("{at}.{name}")));
            }
            let joints = joints.index_quads(self.rows);
            let weights = format!("WEIGHTS_{set}");
            let Some(weights) = self.attribute(&weights, "VEC4", 16)? else {
                return Err(Problem::Lacks("weights for its joints").at_json(at));
            };
            influences.push(Influences {
                joints,
                weights: weights.vectors(self.rows, |weights| weights),
            });
        }
        if influences.is_empty() {
            let at = format!("{}.attributes", self.at);
            return Err(Problem::Lacks("JOINTS_0, which its skin needs").at_json(at));
        }
        let count = skin.world_from_bind.len();
        for (set, influences) in influences.iter().enumerate() {
            if let Some(index) = influences.beyond(count) {
                let index = index.into();
                let at = format!("{}.attributes.JOINTS_{set}", self.at);
                let what = "joint";
                return Err(Problem::NoSuch { what, index, count }.at_json(at));
            }
        }
        let matrices = (0..mesh.positions.len())
            .into_par_iter()
            .with_min_len(VERTICES_PER_TASK)
            .map(|vertex| skin.blend(&influences, vertex));
        if mesh.normals.is_empty() {
            let bent = matrices.zip(&mesh.positions);
            mesh.positions = bent
                .map(|(matrix, &p)| matrix.transform_point3(p))
                .collect();
        } else {
            let bent = matrices.zip(mesh.positions.par_iter().zip(&mesh.normals));
            (mesh.positions, mesh.normals) = bent
                .map(|(matrix, (&position, &normal))| {
                    let position = matrix.transform_point3(position);
                    (position, turned(&DMat3::from_mat4(matrix), normal))
                })
                .unzip();
        }
        Ok(())
    }
}

/// Four joints of each vertex, and how much each of them counts.
struct Influences {
    joints: Vec<[u32; 4]>,
    weights: Vec<[f32; 4]>,
}

impl Influences {
    fn of(&self, vertex: usize) -> impl Iterator<Item = (u32, f32)> {
        self.joints[vertex].into_iter().zip(self.weights[vertex])
    }

    /// A joint beyond the `count` that there are, among those that count.
    fn beyond(&self, count: usize) -> Option<u32> {
        let all = (0..self.joints.len()).flat_map(|vertex| self.of(vertex));
        let mut counting = all.filter(|&(_, weight)| weight != 0.0);
        let beyond = |&(joint, _): &(u32, f32)| joint as usize >= count;
        counting.find(beyond).map(|(joint, _)| joint)
    }
}

impl Skin {
    /// The mean of a vertex's joints. Weights need not add up to 1 in the file, where they may be
    /// rounded; without any, the first joint moves the vertex.
    fn blend(&self, influences: &[Influences], vertex: usize) -> DMat4 {
        let mut sum = DMat4::ZERO;
        let mut whole = 0.0;
        for (joint, weight) in influences.iter().flat_map(|set| set.of(vertex)) {
            if weight != 0.0 {
                let weight = f64::from(weight);
                sum += self.world_from_bind[joint as usize] * weight;
                whole += weight;
            }
        }
        if whole == 0.0 {
            let first = influences[0].joints[vertex][0] as usize;
            let known = self.world_from_bind.get(first);
            return known.copied().unwrap_or(DMat4::IDENTITY);
        }
        sum * (1.0 / whole)
    }
}

/// A normal on a surface that `matrix` moves: at right angles to it under any shear, and on the same
/// side. That is the inverse transpose, but for its scale; this form exists for flat matrices, too.
fn turned(matrix: &DMat3, normal: Vec3) -> Vec3 {
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = *matrix;
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let side = if matrix.determinant() < 0.0 {
        -1.0
    } else {
        1.0
    };
    let turned = cofactors * normal.as_dvec3() * side;
    // Here, since the scale may be too small for single precision.
    turned.normalize_or_zero().as_vec3()
}

/// Adds a share of a morph target's colours; they stay between 0 and 1 (glTF 2.0, §3.7.2.2).
fn add_colors(mesh: &mut Mesh, added: &Elements<'_>, weight: f32, rows: Option<&[u32]>) {
    let shares = added.vectors(rows, |d: [f32; 3]| d.map(|part| part * weight));
    for (color, share) in mesh.colors.iter_mut().zip(shares) {
        for (part, share) in color.iter_mut().zip(share) {
            *part = (*part + share).clamp(0.0, 1.0);
        }
    }
    if !mesh.opacities.is_empty() && added.components == 4 {
        let shares = added.vectors(rows, |[_, _, _, a]: [f32; 4]| a * weight);
        for (opacity, share) in mesh.opacities.iter_mut().zip(shares) {
            *opacity = (*opacity + share).clamp(0.0, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_at_right_angles_and_on_their_side() {
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.2), 3.0 * DVec3::Z);
        let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let along = [normal.cross(DVec3::X), normal.cross(DVec3::Y)];
        for matrix in [shear, shear * -1.0, shear * 1e-30] {
            let turned = turned(&matrix, normal.as_vec3()).as_dvec3();
            for tangent in along {
                assert!(turned.dot((matrix * tangent).normalize()).abs() < 1e-6);
            }
            assert!(turned.dot(matrix * normal) > 0.0);
        }
        // What is pressed flat has the normal of the flat.
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(turned(&flat, Vec3::new(0.6, 0.0, 0.8)), Vec3::Z);
    }
}
