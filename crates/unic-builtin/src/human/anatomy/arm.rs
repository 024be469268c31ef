//! Arm and hand.

use super::{Anatomy, Segment};

/// Sections of the upper arm: distance from the shoulder, half width, depths upward and downward,
/// metres.
const UPPER_ARM: [[f32; 4]; 5] = [
    [0.000, 0.047, 0.046, 0.050],
    [0.060, 0.049, 0.050, 0.052],
    [0.140, 0.045, 0.048, 0.047],
    [0.220, 0.040, 0.041, 0.040],
    [0.290, 0.036, 0.035, 0.036],
];

/// Sections of the forearm: distance from the elbow, half width, depths upward and downward,
/// metres.
const FOREARM: [[f32; 4]; 5] = [
    [0.000, 0.036, 0.035, 0.036],
    [0.055, 0.039, 0.039, 0.038],
    [0.120, 0.035, 0.034, 0.034],
    [0.190, 0.027, 0.024, 0.024],
    [0.248, 0.027, 0.019, 0.019],
];

/// Sections of the palm: distance from the wrist, half width, depths upward and downward, metres.
const PALM: [[f32; 4]; 4] = [
    [0.000, 0.027, 0.018, 0.019],
    [0.030, 0.034, 0.016, 0.019],
    [0.065, 0.041, 0.014, 0.016],
    [0.088, 0.041, 0.012, 0.013],
];

/// A finger, metres.
struct Finger {
    /// x and z of the knuckle.
    root: [f32; 2],
    /// x and z of the centre of the rounded tip.
    tip: [f32; 2],
    /// Radii at the root and at the tip.
    radii: [f32; 2],
}

/// The four fingers, index finger first; they fan out a little.
const FINGERS: [Finger; 4] = [
    Finger {
        root: [0.780, 0.014],
        tip: [0.859, 0.030],
        radii: [0.0100, 0.0078],
    },
    Finger {
        root: [0.785, -0.008],
        tip: [0.872, -0.005],
        radii: [0.0100, 0.0080],
    },
    Finger {
        root: [0.781, -0.030],
        tip: [0.861, -0.040],
        radii: [0.0095, 0.0075],
    },
    Finger {
        root: [0.772, -0.050],
        tip: [0.834, -0.071],
        radii: [0.0085, 0.0066],
    },
];

impl Anatomy {
    pub(super) fn arm(&mut self) {
        let (seg, elbow) = (Segment::Arm, [0.455, 1.385, -0.026]);
        self.limb(seg, 0.045, [[0.165, 1.385, -0.020], elbow], &UPPER_ARM);
        // The deltoid.
        self.ellipsoid(seg, 0.030, [0.185, 1.392, -0.020], [0.062, 0.047, 0.056], 0.0);
        self.limb(seg, 0.020, [elbow, [0.703, 1.385, -0.020]], &FOREARM);
    }

    pub(super) fn hand(&mut self) {
        let palm = [[0.698, 1.385, -0.020], [0.786, 1.383, -0.019]];
        self.limb(Segment::Arm, 0.012, palm, &PALM);
        FINGERS.into_iter().for_each(|finger| self.finger(finger));
        self.thumb();
    }

    fn finger(&mut self, finger: Finger) {
        let ([x0, z0], [x1, z1], [r0, r1]) = (finger.root, finger.tip, finger.radii);
        // Two cones that meet in the middle, the outer one bent down.
        let (x, z, r) = ((x0 + x1) * 0.5, (z0 + z1) * 0.5, (r0 + r1) * 0.5);
        self.cone(Segment::Arm, 0.007, [[x0, 1.383, z0], [x, 1.382, z]], [r0, r]);
        self.cone(Segment::Arm, 0.004, [[x, 1.382, z], [x1, 1.372, z1]], [r, r1]);
    }

    fn thumb(&mut self) {
        let (root, joint, tip) = (
            [0.722, 1.376, 0.004],
            [0.762, 1.371, 0.036],
            [0.796, 1.368, 0.053],
        );
        self.cone(Segment::Arm, 0.020, [root, joint], [0.0165, 0.0125]);
        self.cone(Segment::Arm, 0.006, [joint, tip], [0.0120, 0.0088]);
    }
}
