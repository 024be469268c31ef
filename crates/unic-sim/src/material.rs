//! Fabrics, in the units of the textile laboratory.

use serde::{Deserialize, Serialize};

/// A woven or knitted fabric.
///
/// The presets have values typical of such fabrics, measured with the Kawabata evaluation system
/// (S. Kawabata, "The Standardization and Analysis of Hand Evaluation", 1980). Its data sheets give
/// bending rigidity B in gf·cm²/cm (9.81e-5 N·m) and shear rigidity G in gf/(cm·degree) (56.2 N/m
/// per radian). Single fabrics differ by a factor of two and more.
///
/// Tensile stiffness is that of small loads, at which the crimp of the yarns straightens. The
/// stiffness at 500 gf/cm, the largest load of the data sheets, is several times higher. Garments
/// do not reach such loads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Mass per area, kg/m².
    pub area_density: f32,
    /// Tension per width and strain along the warp, N/m. The warp runs along the v axis of the UVs
    /// where a mesh has them, else along the vertical of the rest shape, see
    /// [`Cloth`](crate::Cloth).
    pub warp_stiffness: f32,
    /// Tension per width and strain across the warp, N/m.
    pub weft_stiffness: f32,
    /// Shear force per width and radian of shear angle, N/m.
    pub shear_stiffness: f32,
    /// Moment per width and curvature, N·m: Kawabata's B.
    pub bending_stiffness: f32,
    /// Time constant τ of internal damping in bending, seconds. The damping moment is τ·B times the
    /// rate of change of curvature.
    pub bending_damping_s: f32,
    /// Distance between the cloth's middle surface and the body in contact, and between two layers
    /// of cloth, metres. Real fabrics are thinner; a triangle mesh needs the margin.
    pub thickness: f32,
    /// Coefficient of static friction on skin.
    pub static_friction: f32,
    /// Coefficient of sliding friction on skin.
    pub sliding_friction: f32,
}

impl Material {
    /// Shirting, plain weave: 150 g/m², B about 0.08 gf·cm²/cm, G about 0.9 gf/(cm·degree).
    pub const COTTON: Self = Self {
        area_density: 0.15,
        warp_stiffness: 1000.0,
        weft_stiffness: 800.0,
        shear_stiffness: 50.0,
        bending_stiffness: 8e-6,
        bending_damping_s: 0.01,
        thickness: 0.003,
        static_friction: 0.5,
        sliding_friction: 0.4,
    };

    /// A heavy, stiff twill: 400 g/m², B about 0.8 gf·cm²/cm, G about 4 gf/(cm·degree).
    pub const DENIM: Self = Self {
        area_density: 0.4,
        warp_stiffness: 3000.0,
        weft_stiffness: 2000.0,
        shear_stiffness: 220.0,
        bending_stiffness: 8e-5,
        bending_damping_s: 0.015,
        thickness: 0.004,
        static_friction: 0.55,
        sliding_friction: 0.45,
    };

    /// Habutae: 60 g/m², B about 0.03 gf·cm²/cm, G about 0.3 gf/(cm·degree).
    pub const SILK: Self = Self {
        area_density: 0.06,
        warp_stiffness: 800.0,
        weft_stiffness: 600.0,
        shear_stiffness: 17.0,
        bending_stiffness: 3e-6,
        bending_damping_s: 0.005,
        thickness: 0.002,
        static_friction: 0.35,
        sliding_friction: 0.3,
    };

    /// Nylon net of a skirt's layers: 25 g/m², stiff for its weight, easily sheared.
    pub const TULLE: Self = Self {
        area_density: 0.025,
        warp_stiffness: 300.0,
        weft_stiffness: 200.0,
        shear_stiffness: 20.0,
        bending_stiffness: 4e-6,
        bending_damping_s: 0.005,
        thickness: 0.002,
        static_friction: 0.4,
        sliding_friction: 0.35,
    };

    /// All presets with their names on the command line.
    pub const PRESETS: [(&'static str, Self); 4] = [
        ("cotton", Self::COTTON),
        ("denim", Self::DENIM),
        ("silk", Self::SILK),
        ("tulle", Self::TULLE),
    ];

    /// Returns the preset of a name.
    pub fn preset(name: &str) -> Option<Self> {
        let found = Self::PRESETS.iter().find(|(known, _)| *known == name);
        found.map(|(_, material)| *material)
    }

    /// Returns the name and value of the first invalid quantity. The density must be positive, the
    /// others not negative, all finite.
    pub(crate) fn first_invalid(&self) -> Option<(&'static str, f32)> {
        let quantities = [
            ("area_density", self.area_density),
            ("warp_stiffness", self.warp_stiffness),
            ("weft_stiffness", self.weft_stiffness),
            ("shear_stiffness", self.shear_stiffness),
            ("bending_stiffness", self.bending_stiffness),
            ("bending_damping_s", self.bending_damping_s),
            ("thickness", self.thickness),
            ("static_friction", self.static_friction),
            ("sliding_friction", self.sliding_friction),
        ];
        let is_bad = |(name, value): &(&str, f32)| {
            !value.is_finite() || *value < 0.0 || (*name == "area_density" && *value == 0.0)
        };
        quantities.into_iter().find(is_bad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_found_by_name() {
        for (name, material) in Material::PRESETS {
            assert_eq!(material.first_invalid(), None, "{name}");
            assert_eq!(Material::preset(name), Some(material));
        }
        assert_eq!(Material::preset("chain mail"), None);
        let weightless = Material {
            area_density: 0.0,
            ..Material::SILK
        };
        assert_eq!(weightless.first_invalid(), Some(("area_density", 0.0)));
    }
}
