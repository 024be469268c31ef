//! Head and face.

use super::{Anatomy, Hollow, Segment};
use crate::human::primitive::Primitive;
use glam::Vec3;

impl Anatomy {
    pub(super) fn head(&mut self) {
        self.skull();
        self.eye_socket();
        self.features();
    }

    /// Adds cranium, face, jaw, chin, cheekbones and brow, in this order.
    fn skull(&mut self) {
        let seg = Segment::Head;
        self.ellipsoid(seg, 0.025, [0.0, 1.609, -0.008], [0.0755, 0.0915, 0.0945], 0.0);
        self.ellipsoid(seg, 0.030, [0.0, 1.560, 0.030], [0.0535, 0.076, 0.060], 0.12);
        let jaw = [[0.040, 1.530, 0.008], [0.010, 1.499, 0.062]];
        self.cone(seg, 0.025, jaw, [0.0150, 0.0160]);
        self.ellipsoid(seg, 0.015, [0.0, 1.497, 0.074], [0.017, 0.014, 0.012], 0.0);
        self.ellipsoid(seg, 0.020, [0.040, 1.560, 0.050], [0.018, 0.016, 0.022], 0.0);
        self.ellipsoid(seg, 0.020, [0.027, 1.608, 0.068], [0.030, 0.009, 0.016], 0.0);
    }

    fn eye_socket(&mut self) {
        let socket = Primitive::Ellipsoid {
            centre: Vec3::new(0.031, 1.588, 0.101),
            half: Vec3::new(0.021, 0.012, 0.018),
            pitch: 0.0,
        };
        self.hollows.push(Hollow {
            primitive: socket,
            blend: 0.020,
        });
    }

    /// Adds nose bridge, nostrils, cheeks, mouth and ears, in this order.
    fn features(&mut self) {
        let seg = Segment::Head;
        let bridge = [[0.0, 1.594, 0.085], [0.0, 1.558, 0.103]];
        self.cone(seg, 0.012, bridge, [0.007, 0.0105]);
        self.ellipsoid(seg, 0.008, [0.008, 1.551, 0.095], [0.0105, 0.0075, 0.0105], 0.0);
        self.ellipsoid(seg, 0.030, [0.030, 1.532, 0.036], [0.024, 0.032, 0.030], 0.0);
        self.ellipsoid(seg, 0.024, [0.0, 1.529, 0.058], [0.029, 0.032, 0.029], 0.0);
        self.ellipsoid(seg, 0.010, [0.075, 1.572, -0.012], [0.0085, 0.030, 0.018], -0.25);
    }
}
