//! Trunk and neck.

use super::{Anatomy, Segment};
use crate::human::{
    primitive::{Loft, LoftSection, Primitive},
    proportions::Girths,
};
use glam::Vec3;

/// Sections of the trunk: height, half width, depths to the front and to the back, metres.
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
    pub(super) fn trunk(&mut self) {
        let sections = TRUNK.map(|[along, side, front, back]| {
            let girth = girth_factor(self.proportions.girths, along);
            LoftSection {
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
            sections: sections.to_vec(),
        };
        self.add(Segment::Trunk, 0.03, Primitive::Loft(trunk));
        self.muscles();
        self.neck();
    }

    fn muscles(&mut self) {
        let seg = Segment::Trunk;
        let Girths { chest, waist, hip } = self.proportions.girths;
        let buttock = [0.070 * hip, 0.885, -0.062 * hip];
        self.ellipsoid(seg, 0.05, buttock, [0.074 * hip, 0.080, 0.070 * hip], -0.2);
        let pectoral = [0.072 * chest, 1.275, 0.062 * chest];
        self.ellipsoid(seg, 0.04, pectoral, [0.074, 0.056, 0.050], 0.25);
        let shoulder_blade = [0.085 * chest, 1.290, -0.070 * chest];
        self.ellipsoid(seg, 0.04, shoulder_blade, [0.060, 0.080, 0.046], 0.1);
        let belly = [0.0, 1.000, 0.055 * waist];
        self.ellipsoid(seg, 0.06, belly, [0.085 * waist, 0.085, 0.044 * waist], 0.0);
    }

    /// The neck, and the slope from it to the shoulder.
    fn neck(&mut self) {
        let slope = [[0.020, 1.428, -0.038], [0.145, 1.393, -0.026]];
        self.cone(Segment::Trunk, 0.04, slope, [0.040, 0.035]);
        let neck = [[0.0, 1.400, -0.032], [0.0, 1.530, -0.006]];
        self.cone(Segment::Trunk, 0.035, neck, [0.056, 0.049]);
    }
}

/// Factor on the standard width of the trunk at a height in metres.
///
/// It takes the given values at hips, waist and chest, is 1 at the neck, and blends smoothly
/// between.
fn girth_factor(girths: Girths, height: f32) -> f32 {
    let known = [
        (0.92, girths.hip),
        (1.07, girths.waist),
        (1.28, girths.chest),
        (1.36, girths.chest),
        (1.45, 1.0),
    ];
    let above = known
        .partition_point(|(h, _)| *h <= height)
        .clamp(1, known.len() - 1);
    let ((low, a), (high, b)) = (known[above - 1], known[above]);
    let t = ((height - low) / (high - low)).clamp(0.0, 1.0);
    a + (b - a) * t * t * (3.0 - 2.0 * t)
}
