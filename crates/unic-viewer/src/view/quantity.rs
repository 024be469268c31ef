//! Quantities that colours show.

use super::body::Body;
use super::track::Track;
use crate::{Shading, Vertex};
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{skinning::SkinningWeights, surface::Surface};
use unic_raster::heat_colours;

/// Quantity that all panes show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quantity {
    /// Materials in light and shadow.
    #[default]
    Lit,
    /// Materials with the edges of the meshes.
    Wireframe,
    /// Normals: x, y and z as red, green and blue.
    Normals,
    /// Distance of each garment vertex from its true place.
    Error,
    /// Skinning weights: each joint has a colour, and weights blend them.
    Weights,
    /// Garment vertices inside the body, in red. The body is drawn smaller, so that it hides none.
    Intersections,
}

/// Numbers that a quantity shows in a pane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PaneFacts {
    /// No numbers.
    #[default]
    None,
    /// The quantity is unknown in this pane, such as an error without a ground truth.
    Unknown,
    /// Error of the frame, metres.
    Error {
        /// Root mean square over the vertices.
        rmse_m: f32,
        /// Largest.
        most_m: f32,
    },
    /// Intersections of the frame.
    Intersections {
        /// Number of garment vertices inside the body.
        vertices: usize,
        /// Depth of the deepest one, metres.
        deepest_m: f32,
    },
}

/// Shapes and colours of a pane.
#[derive(Debug, Default)]
pub(super) struct Shown {
    /// Frame of the garment; none while it is not computed.
    pub(super) frame: Option<usize>,
    /// Frame, quantity and end of the heat map of the colours.
    coloured: Option<(Option<usize>, Quantity, f32)>,
    pub(super) garment: Vec<Vertex>,
    pub(super) garment_colours: Option<Vec<[f32; 3]>>,
    /// Body other than as it is.
    pub(super) body: Option<Vec<Vertex>>,
    pub(super) body_colours: Option<Vec<[f32; 3]>>,
    pub(super) facts: PaneFacts,
}

/// Colour of garment vertices outside the body, sRGB.
const OUTSIDE: [f32; 3] = [0.78, 0.79, 0.80];
/// Colour of garment vertices inside the body, sRGB.
const INSIDE: [f32; 3] = [0.88, 0.10, 0.08];
/// Distance of the body that is drawn smaller from the deepest vertex, metres.
const CLEARANCE_M: f32 = 0.004;
/// Largest distance by which a body is drawn smaller, metres: thin parts would turn inside out.
const SMALLER_M: f32 = 0.02;

impl Quantity {
    /// All quantities, in the order of a key.
    pub const ALL: [Self; 6] = [
        Self::Lit,
        Self::Wireframe,
        Self::Normals,
        Self::Error,
        Self::Weights,
        Self::Intersections,
    ];

    /// Name to show.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lit => "lit",
            Self::Wireframe => "wireframe",
            Self::Normals => "normals",
            Self::Error => "error",
            Self::Weights => "weights",
            Self::Intersections => "intersections",
        }
    }

    /// Shading of a part that has colours of its own, or none.
    pub(super) fn shading(self, has_colours: bool) -> Shading {
        match self {
            Self::Wireframe => Shading::Wireframe,
            Self::Normals => Shading::Normals,
            Self::Error | Self::Weights if has_colours => Shading::Flat,
            Self::Lit | Self::Error | Self::Weights | Self::Intersections => Shading::Lit,
        }
    }
}

impl PaneFacts {
    /// Words to show, empty if there is nothing to say.
    pub fn text(&self) -> String {
        match *self {
            Self::None => String::new(),
            Self::Unknown => "unknown here".into(),
            Self::Error { rmse_m, most_m } => {
                format!("RMSE {:.1}, most {:.0} mm", rmse_m * 1e3, most_m * 1e3)
            }
            Self::Intersections { vertices: 0, .. } => "no vertex inside".into(),
            Self::Intersections { vertices, deepest_m } => {
                format!("{vertices} inside, deepest {:.1} mm", deepest_m * 1e3)
            }
        }
    }
}

impl Shown {
    /// Fills in the colours of a quantity for the garment that is shown.
    pub(super) fn colour(&mut self, quantity: Quantity, track: &Track, body: &mut Body, most_m: f32) {
        let wanted = Some((self.frame, quantity, most_m));
        if self.coloured == wanted {
            return;
        }
        self.coloured = wanted;
        self.garment_colours = None;
        self.body_colours = None;
        self.body = None;
        self.facts = PaneFacts::None;
        match quantity {
            Quantity::Lit | Quantity::Wireframe | Quantity::Normals => {}
            Quantity::Error => self.colour_error(track, most_m),
            Quantity::Weights => {
                self.garment_colours = track.weights().map(weight_colours);
                self.body_colours = body.weights().map(weight_colours);
                if self.garment_colours.is_none() {
                    self.facts = PaneFacts::Unknown;
                }
            }
            Quantity::Intersections => self.colour_intersections(body),
        }
    }

    fn colour_error(&mut self, track: &Track, most_m: f32) {
        let truth = track.truth().zip(self.frame);
        let Some((truth, frame)) = truth.filter(|(truth, frame)| *frame < truth.frame_count()) else {
            // The truth itself is known to be right.
            self.facts = match track.is_truth() {
                true => PaneFacts::None,
                false => PaneFacts::Unknown,
            };
            return;
        };
        let errors = errors_m(&self.garment, truth.positions(frame));
        self.garment_colours = Some(heat_colours(&errors, most_m));
        let squares: f64 = errors.iter().map(|&error| f64::from(error).powi(2)).sum();
        self.facts = PaneFacts::Error {
            rmse_m: (squares / errors.len().max(1) as f64).sqrt() as f32,
            most_m: errors.iter().copied().fold(0.0, f32::max),
        };
    }

    fn colour_intersections(&mut self, body: &mut Body) {
        let Some(surface) = body.surface() else {
            self.facts = PaneFacts::Unknown;
            return;
        };
        let depths = depths_m(&self.garment, surface);
        let deepest_m = depths.iter().copied().fold(0.0, f32::max);
        self.facts = PaneFacts::Intersections {
            vertices: depths.iter().filter(|&&depth| depth > 0.0).count(),
            deepest_m,
        };
        let colour = |&depth: &f32| if depth > 0.0 { INSIDE } else { OUTSIDE };
        self.garment_colours = Some(depths.iter().map(colour).collect());
        let inwards = (deepest_m + CLEARANCE_M).min(SMALLER_M);
        let smaller = |vertex: &Vertex| Vertex {
            position: vertex.position - vertex.normal * inwards,
            ..*vertex
        };
        self.body = Some(body.vertices().iter().map(smaller).collect());
    }
}

/// Distances of vertices from their true places, metres.
pub(super) fn errors_m(garment: &[Vertex], truth: &[Vec3]) -> Vec<f32> {
    let pairs = garment.iter().zip(truth);
    pairs
        .map(|(vertex, truth)| vertex.position.distance(*truth))
        .collect()
}

/// Depths of vertices inside a surface, metres; 0 outside.
pub(super) fn depths_m(garment: &[Vertex], surface: &Surface) -> Vec<f32> {
    // Deeper vertices do not exist in garments that are worn.
    const REACH_M: f32 = 0.1;
    let depth = |vertex: &Vertex| {
        let hit = surface.closest_within(vertex.position, REACH_M);
        hit.map_or(0.0, |hit| (-hit.signed_distance).max(0.0))
    };
    garment.par_iter().map(depth).collect()
}

/// Colours of skinning weights, sRGB: the colours of the joints, blended.
pub(super) fn weight_colours(weights: &SkinningWeights) -> Vec<[f32; 3]> {
    let palette: Vec<Vec3> = (0..weights.joint_count()).map(joint_colour).collect();
    let blend = |vertex| -> Vec3 {
        weights
            .row(vertex)
            .map(|(joint, weight)| palette[joint] * weight)
            .sum()
    };
    (0..weights.len())
        .map(|vertex| blend(vertex).to_array())
        .collect()
}

/// Colour of a joint, sRGB. Joints with near indices, which are near on the body, differ most.
fn joint_colour(joint: usize) -> Vec3 {
    /// Fraction of the golden ratio: its multiples are spread evenly over the circle of hues.
    const TURN: f32 = 0.618_034;
    let hue = (joint as f32 * TURN).fract() * 6.0;
    let channel = |offset: f32| {
        let k = (offset + hue) % 6.0;
        0.92 - 0.62 * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    Vec3::new(channel(5.0), channel(3.0), channel(1.0))
}
