//! Proof that a scene is what its types promise.

use crate::{
    fault::Fault,
    scene::{Local, Mesh, Motion, PointSamples, Scene, Shape, Skin},
};
use glam::Vec3;

/// Largest number of joints of a skin: weights name them by 16 bits.
const MOST_JOINTS: usize = u16::MAX as usize;

impl Scene {
    /// Checks every index, count and number. Readers may be wrong about a damaged file, and a child
    /// process may answer anything.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), Fault> {
        self.check_nodes()?;
        self.skins
            .iter()
            .try_for_each(|skin| check_skin(skin, self.nodes.len()))?;
        for mesh in &self.meshes {
            self.check_mesh(mesh).map_err(|fault| {
                Fault::new(
                    format!("{} in the mesh {}", fault.expected, mesh.name),
                    fault.found,
                )
            })?;
        }
        match &self.motion {
            Some(motion) => check_motion(motion, self.nodes.len()),
            None => Ok(()),
        }
    }

    fn check_nodes(&self) -> Result<(), Fault> {
        let count = self.nodes.len();
        for node in &self.nodes {
            if node.parent.is_some_and(|parent| parent >= count) {
                return Err(Fault::new(
                    format!("parents below {count}"),
                    format!("{:?}", node.parent),
                ));
            }
            if !is_finite(&node.local) {
                return Err(Fault::new(
                    "finite transforms",
                    format!("others at {}", node.name),
                ));
            }
        }
        match self.order() {
            Some(_) => Ok(()),
            None => Err(Fault::new("a tree of nodes", "a cycle")),
        }
    }

    /// Returns the nodes in an order in which parents precede their children; None if some are
    /// their own ancestors.
    pub fn order(&self) -> Option<Vec<usize>> {
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); self.nodes.len()];
        let mut order = Vec::new();
        for (index, node) in self.nodes.iter().enumerate() {
            match node.parent {
                Some(parent) => children.get_mut(parent)?.push(index),
                None => order.push(index),
            }
        }
        let mut next = 0;
        while let Some(&node) = order.get(next) {
            order.extend_from_slice(&children[node]);
            next += 1;
        }
        (order.len() == self.nodes.len()).then_some(order)
    }

    fn check_mesh(&self, mesh: &Mesh) -> Result<(), Fault> {
        let joints = match mesh.skin {
            Some(skin) => match self.skins.get(skin) {
                Some(skin) => skin.joints.len(),
                None => {
                    return Err(Fault::new(
                        format!("skins below {}", self.skins.len()),
                        skin.to_string(),
                    ));
                }
            },
            None => 0,
        };
        if let Some(shape) = &mesh.shape {
            check_shape(shape, joints)?;
        }
        let vertices = mesh
            .shape
            .as_ref()
            .map_or(mesh.vertices, |shape| shape.points.len());
        if vertices != mesh.vertices {
            return Err(Fault::new(
                format!("{} vertices", mesh.vertices),
                vertices.to_string(),
            ));
        }
        match &mesh.points {
            Some(points) => check_points(points, vertices),
            None => Ok(()),
        }
    }
}

fn is_finite(local: &Local) -> bool {
    local.translation.is_finite()
        && local.rotation.is_finite()
        && local.scale.is_finite()
        && local.matrix().is_finite()
}

fn check_skin(skin: &Skin, nodes: usize) -> Result<(), Fault> {
    if skin.joints.is_empty() || skin.joints.len() > MOST_JOINTS {
        let expected = format!("a skin of 1 to {MOST_JOINTS} joints");
        return Err(Fault::new(expected, skin.joints.len().to_string()));
    }
    if skin.inverse_binds.len() != skin.joints.len() {
        let expected = format!("a bind matrix for each of {} joints", skin.joints.len());
        return Err(Fault::new(expected, skin.inverse_binds.len().to_string()));
    }
    if let Some(joint) = skin.joints.iter().find(|joint| **joint >= nodes) {
        return Err(Fault::new(format!("joints below {nodes}"), joint.to_string()));
    }
    let binds = skin.inverse_binds.iter().chain(&skin.world_from_mesh);
    match binds.into_iter().all(|bind| bind.is_finite()) {
        true => Ok(()),
        false => Err(Fault::new("finite bind matrices", "others")),
    }
}

fn check_shape(shape: &Shape, joints: usize) -> Result<(), Fault> {
    let count = shape.points.len();
    check_finite(&shape.points)?;
    if let Some(face) = (shape.faces.iter()).find(|face| face.iter().any(|corner| *corner as usize >= count))
    {
        return Err(Fault::new(
            format!("faces of vertices below {count}"),
            format!("{face:?}"),
        ));
    }
    if !matches!(shape.weights.len(), 0) && shape.weights.len() != count {
        let expected = format!("weights of {count} vertices");
        return Err(Fault::new(expected, shape.weights.len().to_string()));
    }
    for (joint, weight) in shape.weights.iter().flatten() {
        if usize::from(*joint) >= joints {
            return Err(Fault::new(format!("joints below {joints}"), joint.to_string()));
        }
        if !weight.is_finite() {
            return Err(Fault::new("finite weights", weight.to_string()));
        }
    }
    Ok(())
}

fn check_points(points: &PointSamples, vertices: usize) -> Result<(), Fault> {
    if let Some(fps) = points.fps
        && !(fps.is_finite() && fps > 0.0)
    {
        return Err(Fault::new("frames per second above 0", fps.to_string()));
    }
    for (frame, points) in points.frames.iter().enumerate() {
        if points.len() != vertices {
            let found = format!("{} in frame {frame}", points.len());
            return Err(Fault::new(format!("{vertices} points in every frame"), found));
        }
        check_finite(points)
            .map_err(|fault| Fault::new(fault.expected, format!("{} in frame {frame}", fault.found)))?;
    }
    Ok(())
}

fn check_finite(points: &[Vec3]) -> Result<(), Fault> {
    match points.iter().position(|point| !point.is_finite()) {
        None => Ok(()),
        Some(vertex) => Err(Fault::new(
            "finite positions",
            format!("others at vertex {vertex}"),
        )),
    }
}

fn check_motion(motion: &Motion, nodes: usize) -> Result<(), Fault> {
    if !(motion.fps.is_finite() && motion.fps > 0.0) {
        return Err(Fault::new("frames per second above 0", motion.fps.to_string()));
    }
    if motion.frames < 2 {
        return Err(Fault::new("at least two frames", motion.frames.to_string()));
    }
    for track in &motion.tracks {
        if track.node >= nodes {
            return Err(Fault::new(format!("nodes below {nodes}"), track.node.to_string()));
        }
        if track.locals.len() != motion.frames {
            let expected = format!("{} transforms of a node", motion.frames);
            return Err(Fault::new(expected, track.locals.len().to_string()));
        }
        if let Some(frame) = track.locals.iter().position(|local| !is_finite(local)) {
            return Err(Fault::new(
                "finite transforms",
                format!("others in frame {frame}"),
            ));
        }
    }
    Ok(())
}
