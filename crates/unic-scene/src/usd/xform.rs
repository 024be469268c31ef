//! Transforms of prims: the stacks of their `xformOp` attributes.

use super::{sampled::Sampled, stage::Prims, value};
use crate::{
    fault::Fault,
    scene::{Local, Node, Scene},
};
use glam::{DMat4, DQuat, DVec3};
use openusd::sdf;
use std::collections::HashMap;

/// Word of the order of operations that detaches a prim from its parent.
const RESET: &str = "!resetXformStack!";
/// Mark of an operation whose inverse is meant.
const INVERT: &str = "!invert!";

/// Transforms of the prims that are nodes of the scene.
pub(super) struct Xforms {
    prims: Vec<Xform>,
    /// Node of each prim.
    nodes: HashMap<sdf::Path, usize>,
    metres_y_up: DMat4,
}

/// Transform of a prim over time.
struct Xform {
    parent: Option<usize>,
    operations: Vec<Operation>,
}

struct Operation {
    kind: Kind,
    is_inverse: bool,
}

enum Kind {
    Translate(Sampled<DVec3>),
    Scale(Sampled<DVec3>),
    /// Degrees about the axes, which are applied in their order.
    Rotate(Vec<DVec3>, Sampled<DVec3>),
    Orient(Sampled<DQuat>),
    Matrix(Sampled<DMat4>),
}

impl Xforms {
    /// Reads the transforms, and adds a node for each prim to the scene.
    pub(super) fn read(prims: &Prims, metres_y_up: DMat4, scene: &mut Scene) -> Result<Self, Fault> {
        let mut read = Self {
            prims: Vec::new(),
            nodes: HashMap::new(),
            metres_y_up,
        };
        for path in &prims.needed {
            let (operations, is_detached) = operations(prims, path)?;
            let above = path.parent().and_then(|parent| read.nodes.get(&parent).copied());
            read.nodes.insert(path.clone(), read.prims.len());
            read.prims.push(Xform {
                parent: above.filter(|_| !is_detached),
                operations,
            });
            let node = read.prims.len() - 1;
            scene.nodes.push(Node {
                name: path.name().unwrap_or("prim").to_owned(),
                parent: read.prims[node].parent,
                local: Local::from_matrix(read.local(node, None).as_mat4()),
            });
        }
        Ok(read)
    }

    /// Node of a prim.
    pub(super) fn node(&self, path: &sdf::Path) -> Option<usize> {
        self.nodes.get(path).copied()
    }

    /// Nodes whose transforms change, with the time codes of their samples.
    pub(super) fn animated(&self) -> impl Iterator<Item = (usize, Vec<f64>)> {
        let prims = self.prims.iter().enumerate();
        prims.filter_map(|(node, prim)| {
            // Writers sample still transforms once.
            let lists = prim.operations.iter().map(|operation| operation.kind.times());
            let mut times: Vec<f64> = lists.filter(|times| times.len() > 1).flatten().collect();
            // Operations are sampled at the same times, or each at its own.
            times.sort_by(f64::total_cmp);
            times.dedup();
            (!times.is_empty()).then_some((node, times))
        })
    }

    /// `parent_from_node` at a time code; without one outside any animation. Nodes without a parent
    /// have the conversion to metres, Y up.
    pub(super) fn local(&self, node: usize, time: Option<f64>) -> DMat4 {
        let prim = &self.prims[node];
        let own = prim
            .operations
            .iter()
            .fold(DMat4::IDENTITY, |product, operation| {
                let matrix = operation.kind.matrix(time);
                product
                    * match operation.is_inverse {
                        true => matrix.inverse(),
                        false => matrix,
                    }
            });
        match prim.parent {
            Some(_) => own,
            None => self.metres_y_up * own,
        }
    }

    /// `world_from_node` at a time code.
    pub(super) fn world(&self, node: usize, time: Option<f64>) -> DMat4 {
        // Parents precede their children, so the way up ends.
        let above = std::iter::successors(Some(node), |node| self.prims[*node].parent);
        above.fold(DMat4::IDENTITY, |product, node| self.local(node, time) * product)
    }
}

/// Operations of a prim in their order, and whether it is detached from its parent.
fn operations(prims: &Prims, path: &sdf::Path) -> Result<(Vec<Operation>, bool), Fault> {
    let order = prims.tokens(path, "xformOpOrder")?;
    let mut operations = Vec::new();
    let mut is_detached = false;
    for name in &order {
        if name == RESET {
            operations.clear();
            is_detached = true;
            continue;
        }
        let (name, is_inverse) = match name.strip_prefix(INVERT) {
            Some(name) => (name, true),
            None => (name.as_str(), false),
        };
        // An operation that is named and has no value changes nothing.
        if let Some(kind) = Kind::read(prims, path, name)? {
            operations.push(Operation { kind, is_inverse });
        }
    }
    Ok((operations, is_detached))
}

impl Kind {
    fn read(prims: &Prims, path: &sdf::Path, name: &str) -> Result<Option<Self>, Fault> {
        let word = name.split(':').nth(1).unwrap_or_default();
        let unknown = || Fault::new("transforms of a known kind", format!("{name} at {path}"));
        let vector = || Sampled::read(prims, path, name, value::vector);
        Ok(match word {
            "translate" => vector()?.map(Self::Translate),
            "scale" => vector()?.map(Self::Scale),
            "orient" => Sampled::read(prims, path, name, value::rotation)?.map(Self::Orient),
            "transform" => Sampled::read(prims, path, name, value::matrix)?.map(Self::Matrix),
            _ => {
                let letters = word.strip_prefix("rotate").ok_or_else(unknown)?;
                let axis = |letter| match letter {
                    'X' => Some(DVec3::X),
                    'Y' => Some(DVec3::Y),
                    'Z' => Some(DVec3::Z),
                    _ => None,
                };
                let axes: Option<Vec<DVec3>> = letters.chars().map(axis).collect();
                let axes = axes.ok_or_else(unknown)?;
                let angles = match axes.as_slice() {
                    // One angle turns about its own axis alone.
                    [axis] => Sampled::read(prims, path, name, |v| Some(*axis * value::number(v)?))?,
                    [_, _, _] => vector()?,
                    _ => return Err(unknown()),
                };
                angles.map(|angles| Self::Rotate(axes, angles))
            }
        })
    }

    fn times(&self) -> Vec<f64> {
        match self {
            Self::Translate(values) | Self::Scale(values) | Self::Rotate(_, values) => values.times(),
            Self::Orient(values) => values.times(),
            Self::Matrix(values) => values.times(),
        }
    }

    fn matrix(&self, time: Option<f64>) -> DMat4 {
        // The first time code is before all samples.
        let time = time.unwrap_or(f64::NEG_INFINITY);
        match self {
            Self::Translate(values) => values.at(time).map(DMat4::from_translation),
            Self::Scale(values) => values.at(time).map(DMat4::from_scale),
            Self::Orient(values) => values.at(time).map(DMat4::from_quat),
            Self::Matrix(values) => values.at(time),
            Self::Rotate(axes, values) => values.at(time).map(|degrees| {
                // The first axis turns first, so its matrix is the last factor.
                axes.iter().fold(DMat4::IDENTITY, |product, axis| {
                    DMat4::from_axis_angle(*axis, degrees.dot(*axis).to_radians()) * product
                })
            }),
        }
        .unwrap_or(DMat4::IDENTITY)
    }
}
