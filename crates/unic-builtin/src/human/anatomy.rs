//! The standard body: what it is put together from.

use super::{
    proportions::Proportions,
    shape::{Loft, Shape, Station},
};
use crate::implicit::smooth_min;
use glam::Vec3;

/// Which chain of joints carries a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Segment {
    Trunk,
    Head,
    Arm,
    Leg,
}

/// One piece of the body.
#[derive(Clone, Debug)]
struct Piece {
    segment: Segment,
    shape: Shape,
    /// Reach of the smooth union with what comes before it, metres.
    blend: f32,
    centre: Vec3,
    radius: f32,
}

/// The implicit surface of the left half of a body; the right half mirrors it.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    proportions: Proportions,
    pieces: Vec<Piece>,
    /// What is taken away: the eye sockets.
    hollows: Vec<(Shape, f32)>,
}

/// Round transition between the sides of the feet and their soles, metres.
const SOLE_ROUNDING_M: f32 = 0.012;

/// Sections of the trunk: height, half width, depth to the front and to the back, metres.
const TRUNK: [[f32; 4]; 13] = [
    [0.855, 0.128, 0.074, 0.092],
    [0.888, 0.153, 0.086, 0.106],
    [0.920, 0.164, 0.092, 0.112],
    [0.970, 0.162, 0.096, 0.100],
    [1.020, 0.146, 0.094, 0.084],
    [1.070, 0.134, 0.090, 0.082],
    [1.130, 0.137, 0.094, 0.090],
    [1.200, 0.150, 0.104, 0.102],
    [1.270, 0.162, 0.108, 0.112],
    [1.330, 0.165, 0.098, 0.114],
    [1.375, 0.150, 0.078, 0.106],
    [1.408, 0.104, 0.058, 0.090],
    [1.435, 0.066, 0.044, 0.074],
];

impl Anatomy {
    pub(super) fn new(proportions: &Proportions) -> Self {
        let mut anatomy = Self {
            proportions: proportions.clone(),
            pieces: Vec::new(),
            hollows: Vec::new(),
        };
        anatomy.trunk();
        anatomy.head();
        anatomy.leg();
        anatomy.foot();
        anatomy.arm();
        anatomy.hand();
        anatomy
    }

    /// Near to the signed distance from the skin, metres, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        let mut q = self.proportions.standard(p);
        q.x = q.x.abs();
        let mut distance = f32::MAX;
        for piece in &self.pieces {
            // Beyond its reach a piece does not change the union.
            if q.distance(piece.centre) - piece.radius < distance + piece.blend {
                distance = smooth_min(distance, piece.shape.distance(q), piece.blend);
            }
        }
        for (hollow, blend) in &self.hollows {
            distance = -smooth_min(-distance, hollow.distance(q), *blend);
        }
        -smooth_min(-distance, q.y, SOLE_ROUNDING_M) * self.proportions.scale
    }

    /// For a place of the standard body, on the left: distances from the pieces of each segment,
    /// metres, in the order of [`Segment`].
    pub(super) fn segment_distances(&self, q: Vec3) -> [(Segment, f32); 4] {
        [Segment::Trunk, Segment::Head, Segment::Arm, Segment::Leg].map(|segment| {
            let own = self.pieces.iter().filter(|piece| piece.segment == segment);
            (
                segment,
                own.map(|piece| piece.shape.distance(q)).fold(f32::MAX, f32::min),
            )
        })
    }

    fn add(&mut self, segment: Segment, blend: f32, shape: Shape) {
        let (centre, radius) = shape.bound();
        self.pieces.push(Piece {
            segment,
            shape,
            blend,
            centre,
            radius,
        });
    }

    fn cone(&mut self, segment: Segment, blend: f32, ends: [[f32; 3]; 2], radii: [f32; 2]) {
        let ends = ends.map(Vec3::from);
        self.add(segment, blend, Shape::Cone { ends, radii });
    }

    fn ellipsoid(&mut self, segment: Segment, blend: f32, centre: [f32; 3], half: [f32; 3], pitch: f32) {
        let (centre, half) = (centre.into(), half.into());
        self.add(segment, blend, Shape::Ellipsoid { centre, half, pitch });
    }

    fn trunk(&mut self) {
        let stations = TRUNK.map(|[along, side, front, back]| {
            let girth = girth_factor(self.proportions.girths, along);
            Station {
                along,
                side: side * girth,
                front: front * girth,
                back: back * girth,
            }
        });
        let trunk = Loft {
            origin: Vec3::ZERO,
            axis: Vec3::Y,
            side: Vec3::X,
            front: Vec3::Z,
            power: 2.25,
            stations: stations.to_vec(),
        };
        self.add(Segment::Trunk, 0.03, Shape::Loft(trunk));
        self.muscles();
    }

    fn muscles(&mut self) {
        let [chest, waist, hip] = self.proportions.girths;
        let seg = Segment::Trunk;
        // Buttocks, pectorals, shoulder blades, belly.
        self.ellipsoid(
            seg,
            0.05,
            [0.070 * hip, 0.885, -0.062 * hip],
            [0.074 * hip, 0.080, 0.070 * hip],
            -0.2,
        );
        self.ellipsoid(
            seg,
            0.04,
            [0.072 * chest, 1.275, 0.062 * chest],
            [0.074, 0.056, 0.050],
            0.25,
        );
        self.ellipsoid(
            seg,
            0.04,
            [0.085 * chest, 1.290, -0.070 * chest],
            [0.060, 0.080, 0.046],
            0.1,
        );
        self.ellipsoid(
            seg,
            0.06,
            [0.0, 1.000, 0.055 * waist],
            [0.085 * waist, 0.085, 0.044 * waist],
            0.0,
        );
        // The slope from neck to shoulder, and the neck.
        self.cone(
            seg,
            0.04,
            [[0.020, 1.428, -0.038], [0.145, 1.393, -0.026]],
            [0.040, 0.035],
        );
        self.cone(
            seg,
            0.035,
            [[0.0, 1.400, -0.032], [0.0, 1.530, -0.006]],
            [0.056, 0.049],
        );
    }

    fn head(&mut self) {
        let seg = Segment::Head;
        self.ellipsoid(seg, 0.025, [0.0, 1.609, -0.008], [0.0755, 0.0915, 0.0945], 0.0);
        // Face, jaw, chin, cheekbones, brow.
        self.ellipsoid(seg, 0.030, [0.0, 1.560, 0.030], [0.0535, 0.076, 0.060], 0.12);
        self.cone(
            seg,
            0.025,
            [[0.040, 1.530, 0.008], [0.010, 1.499, 0.062]],
            [0.0150, 0.0160],
        );
        self.ellipsoid(seg, 0.015, [0.0, 1.497, 0.074], [0.017, 0.014, 0.012], 0.0);
        self.ellipsoid(seg, 0.020, [0.040, 1.560, 0.050], [0.018, 0.016, 0.022], 0.0);
        self.ellipsoid(seg, 0.020, [0.027, 1.608, 0.068], [0.030, 0.009, 0.016], 0.0);
        let socket = Shape::Ellipsoid {
            centre: Vec3::new(0.031, 1.588, 0.101),
            half: Vec3::new(0.021, 0.012, 0.018),
            pitch: 0.0,
        };
        self.hollows.push((socket, 0.020));
        // Nose, cheeks and mouth, ears.
        self.cone(
            seg,
            0.012,
            [[0.0, 1.594, 0.085], [0.0, 1.558, 0.103]],
            [0.007, 0.0105],
        );
        self.ellipsoid(seg, 0.008, [0.008, 1.551, 0.095], [0.0105, 0.0075, 0.0105], 0.0);
        self.ellipsoid(seg, 0.030, [0.030, 1.532, 0.036], [0.024, 0.032, 0.030], 0.0);
        self.ellipsoid(seg, 0.024, [0.0, 1.529, 0.058], [0.029, 0.032, 0.029], 0.0);
        self.ellipsoid(seg, 0.010, [0.075, 1.572, -0.012], [0.0085, 0.030, 0.018], -0.25);
    }

    fn leg(&mut self) {
        let hip = self.proportions.girths[2];
        let thigh = [
            [0.000, 0.074 * hip, 0.080 * hip, 0.080 * hip],
            [0.080, 0.076 * hip, 0.084 * hip, 0.082 * hip],
            [0.180, 0.071 * hip, 0.079 * hip, 0.072 * hip],
            [0.280, 0.062, 0.068, 0.060],
            [0.350, 0.052, 0.055, 0.050],
            [0.400, 0.044, 0.046, 0.042],
        ];
        self.limb(
            Segment::Leg,
            0.05,
            [[0.092, 0.885, 0.0], [0.094, 0.484, 0.004]],
            &thigh,
        );
        let calf = [
            [0.000, 0.044, 0.045, 0.040],
            [0.060, 0.049, 0.044, 0.053],
            [0.130, 0.053, 0.043, 0.064],
            [0.200, 0.050, 0.040, 0.056],
            [0.290, 0.038, 0.034, 0.041],
            [0.370, 0.031, 0.031, 0.034],
            [0.405, 0.032, 0.034, 0.036],
        ];
        self.limb(
            Segment::Leg,
            0.03,
            [[0.094, 0.484, 0.004], [0.100, 0.077, -0.026]],
            &calf,
        );
        self.ellipsoid(
            Segment::Leg,
            0.02,
            [0.094, 0.487, 0.036],
            [0.026, 0.034, 0.013],
            0.0,
        );
    }

    fn foot(&mut self) {
        let seg = Segment::Leg;
        self.ellipsoid(seg, 0.020, [0.100, 0.036, -0.050], [0.033, 0.040, 0.034], 0.0);
        self.cone(
            seg,
            0.030,
            [[0.101, 0.070, -0.014], [0.112, 0.030, 0.085]],
            [0.034, 0.025],
        );
        self.cone(
            seg,
            0.020,
            [[0.100, 0.024, -0.040], [0.121, 0.020, 0.085]],
            [0.030, 0.026],
        );
        self.ellipsoid(seg, 0.020, [0.113, 0.022, 0.100], [0.045, 0.024, 0.048], 0.0);
        self.ellipsoid(seg, 0.018, [0.108, 0.019, 0.150], [0.037, 0.018, 0.034], 0.0);
        // The ankle bones.
        self.ellipsoid(seg, 0.015, [0.100, 0.084, -0.022], [0.039, 0.018, 0.020], 0.0);
    }

    fn arm(&mut self) {
        let seg = Segment::Arm;
        let upper = [
            [0.000, 0.047, 0.046, 0.050],
            [0.060, 0.049, 0.050, 0.052],
            [0.140, 0.045, 0.048, 0.047],
            [0.220, 0.040, 0.041, 0.040],
            [0.290, 0.036, 0.035, 0.036],
        ];
        self.limb(
            seg,
            0.045,
            [[0.165, 1.385, -0.020], [0.455, 1.385, -0.026]],
            &upper,
        );
        self.ellipsoid(seg, 0.030, [0.185, 1.392, -0.020], [0.062, 0.047, 0.056], 0.0);
        let forearm = [
            [0.000, 0.036, 0.035, 0.036],
            [0.055, 0.039, 0.039, 0.038],
            [0.120, 0.035, 0.034, 0.034],
            [0.190, 0.027, 0.024, 0.024],
            [0.248, 0.027, 0.019, 0.019],
        ];
        self.limb(
            seg,
            0.020,
            [[0.455, 1.385, -0.026], [0.703, 1.385, -0.020]],
            &forearm,
        );
    }

    fn hand(&mut self) {
        let seg = Segment::Arm;
        let palm = [
            [0.000, 0.027, 0.018, 0.019],
            [0.030, 0.034, 0.016, 0.019],
            [0.065, 0.041, 0.014, 0.016],
            [0.088, 0.041, 0.012, 0.013],
        ];
        self.limb(
            seg,
            0.012,
            [[0.698, 1.385, -0.020], [0.786, 1.383, -0.019]],
            &palm,
        );
        // Root and tip (x, z) and radii of the fingers, index first; they fan out and bend a little.
        let fingers = [
            ([0.780, 0.014], [0.859, 0.030], [0.0100, 0.0078]),
            ([0.785, -0.008], [0.872, -0.005], [0.0100, 0.0080]),
            ([0.781, -0.030], [0.861, -0.040], [0.0095, 0.0075]),
            ([0.772, -0.050], [0.834, -0.071], [0.0085, 0.0066]),
        ];
        for ([x0, z0], [x1, z1], [r0, r1]) in fingers {
            let (x, z, r) = ((x0 + x1) * 0.5, (z0 + z1) * 0.5, (r0 + r1) * 0.5);
            self.cone(seg, 0.007, [[x0, 1.383, z0], [x, 1.382, z]], [r0, r]);
            self.cone(seg, 0.004, [[x, 1.382, z], [x1, 1.372, z1]], [r, r1]);
        }
        self.cone(
            seg,
            0.020,
            [[0.722, 1.376, 0.004], [0.762, 1.371, 0.036]],
            [0.0165, 0.0125],
        );
        self.cone(
            seg,
            0.006,
            [[0.762, 1.371, 0.036], [0.796, 1.368, 0.053]],
            [0.0120, 0.0088],
        );
    }

    /// A loft between two places whose sections' front is towards +Z (a leg's) or +Y (an arm's).
    fn limb(&mut self, segment: Segment, blend: f32, ends: [[f32; 3]; 2], sections: &[[f32; 4]]) {
        let [start, end] = ends.map(Vec3::from);
        let axis = (end - start).normalize();
        let facing = if segment == Segment::Arm { Vec3::Y } else { Vec3::Z };
        let front = facing.reject_from(axis).normalize();
        let station = |&[along, side, front, back]: &[f32; 4]| Station {
            along,
            side,
            front,
            back,
        };
        let loft = Loft {
            origin: start,
            axis,
            side: axis.cross(front),
            front,
            power: 2.1,
            stations: sections.iter().map(station).collect(),
        };
        self.add(segment, blend, Shape::Loft(loft));
    }
}

/// By how much the trunk is wider than standard at a height: as asked for at the hips, the waist and
/// the chest, between them in proportion, and standard at the neck.
fn girth_factor([chest, waist, hip]: [f32; 3], height: f32) -> f32 {
    let known = [
        (0.92, hip),
        (1.07, waist),
        (1.28, chest),
        (1.36, chest),
        (1.45, 1.0),
    ];
    let above = known
        .partition_point(|(h, _)| *h <= height)
        .clamp(1, known.len() - 1);
    let ((low, a), (high, b)) = (known[above - 1], known[above]);
    let t = ((height - low) / (high - low)).clamp(0.0, 1.0);
    a + (b - a) * t * t * (3.0 - 2.0 * t)
}
