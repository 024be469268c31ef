//! Description of a picture: the same for the renderer on wgpu and for the rasteriser.

use crate::ViewerError;
use crate::mesh::Mesh;
use crate::vertex::Vertex;
use glam::{Vec2, Vec3};
use std::sync::Arc;
use unic_gpu::wgpu;
use unic_raster::Ground;

/// Contents of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Bodies and garments.
    pub parts: &'a [Part<'a>],
    /// Flat marks, such as paths on the ground.
    pub marks: &'a [Mark],
    /// Floor.
    pub ground: Ground,
    /// Unit vector to the key light, world space.
    pub to_key: Vec3,
    /// Region that shadows cover; around everything that moves.
    pub focus: Focus,
}

/// Sphere in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// Middle, metres.
    pub centre: Vec3,
    /// Radius, metres.
    pub radius: f32,
}

impl Focus {
    /// Sphere around the box of some points. Points that are not finite are left out; without any
    /// point it is a person's size at the origin.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let points = points.into_iter().filter(|point| point.is_finite());
        let (min, max) = points.fold(start, |(min, max), p| (min.min(p), max.max(p)));
        match min.cmple(max).all() {
            true => Self {
                centre: (min + max) * 0.5,
                radius: ((max - min).length() * 0.5).max(0.1),
            },
            false => Self {
                centre: Vec3::Y,
                radius: 1.2,
            },
        }
    }
}

/// Mesh in a shape, with its looks.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Faces.
    pub mesh: &'a Arc<Mesh>,
    /// Positions and normals.
    pub shape: Shape<'a>,
    /// Colours and structure.
    pub material: Material,
    /// Colour of each vertex of the mesh instead of the material's, sRGB, 0 to 1.
    pub colours: Option<&'a [[f32; 3]]>,
    /// Quantity that is shown.
    pub shading: Shading,
}

/// Positions and normals of a [`Part`].
#[derive(Clone, Copy, Debug)]
pub enum Shape<'a> {
    /// Vertices in memory, one for each vertex of the mesh.
    Host(&'a [Vertex]),
    /// Vertex buffers on the renderer's device, such as
    /// [`vertex_buffer`](unic_gpu::GpuAnimator::vertex_buffer), which are drawn in place.
    Device {
        /// Vertices of the earlier tick.
        before: &'a wgpu::Buffer,
        /// Vertices of the later tick.
        now: &'a wgpu::Buffer,
        /// Place between the ticks: 0 is the earlier one, 1 the later one.
        share: f32,
    },
}

/// Quantity that the colours of a [`Part`] show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// Material in light and shadow.
    #[default]
    Lit,
    /// Normals: x, y and z as red, green and blue.
    Normals,
    /// Colours without light, for maps of a quantity.
    Flat,
    /// Material with the edges of the mesh.
    Wireframe,
}

/// Looks of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Colour, sRGB, 0 to 1.
    pub colour: [f32; 3],
    /// Second colour of the print, sRGB, 0 to 1.
    pub accent: [f32; 3],
    /// Structure of the surface.
    pub fabric: Fabric,
    /// Print on it.
    pub print: Print,
}

impl Material {
    /// Skin.
    pub const SKIN: Self = Self {
        colour: [0.86, 0.71, 0.63],
        accent: [0.5, 0.3, 0.25],
        fabric: Fabric::Skin,
        print: Print::None,
    };

    /// Striped jersey, the looks of a shirt.
    pub const SHIRT: Self =
        Self::cloth(Fabric::Jersey, [0.16, 0.25, 0.45]).printed(Print::Stripes, [0.92, 0.89, 0.82]);

    /// Cloth of one colour.
    pub const fn cloth(fabric: Fabric, colour: [f32; 3]) -> Self {
        Self {
            colour,
            accent: [0.93, 0.90, 0.84],
            fabric,
            print: Print::None,
        }
    }

    /// The same with a print in a second colour.
    #[must_use]
    pub const fn printed(self, print: Print, accent: [f32; 3]) -> Self {
        Self {
            print,
            accent,
            ..self
        }
    }
}

/// Structure of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fabric {
    /// Skin, into which light enters.
    Skin,
    /// Cloth without visible threads.
    Plain,
    /// Fine knit.
    Jersey,
    /// Diagonal weave, as of jeans.
    Twill,
    /// Plain weave of threads that differ.
    Linen,
    /// Shining weave.
    Satin,
}

impl Fabric {
    /// Fabrics of garments.
    pub const CLOTHS: [Self; 5] = [Self::Plain, Self::Jersey, Self::Twill, Self::Linen, Self::Satin];

    /// Name to show.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skin => "skin",
            Self::Plain => "plain",
            Self::Jersey => "jersey",
            Self::Twill => "twill",
            Self::Linen => "linen",
            Self::Satin => "satin",
        }
    }
}

/// Print on cloth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Print {
    /// One colour.
    #[default]
    None,
    /// Stripes every 3.2 cm.
    Stripes,
    /// Checks of 6 cm.
    Checks,
    /// Dots every 3 cm.
    Dots,
}

impl Print {
    /// All prints.
    pub const ALL: [Self; 4] = [Self::None, Self::Stripes, Self::Checks, Self::Dots];

    /// Name to show.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Stripes => "stripes",
            Self::Checks => "checks",
            Self::Dots => "dots",
        }
    }
}

/// Flat triangles of one colour, without light, such as a path on the ground.
#[derive(Clone, Debug, Default)]
pub struct Mark {
    /// Corners of triangles, three each, world space, metres.
    pub corners: Vec<Vec3>,
    /// Colour, sRGB, and opacity, 0 to 1.
    pub colour: [f32; 4],
}

impl Mark {
    /// Ribbon of `width` metres along a path over the ground.
    pub fn ribbon(path: &[Vec3], width: f32, colour: [f32; 4]) -> Self {
        let side = |i: usize| {
            let way = path[(i + 1).min(path.len() - 1)] - path[i.saturating_sub(1)];
            way.cross(Vec3::Y).normalize_or_zero() * (0.5 * width)
        };
        let quad = |i: usize| {
            let (a, b) = (path[i], path[i + 1]);
            let (s, t) = (side(i), side(i + 1));
            [a - s, a + s, b + t, a - s, b + t, b - t]
        };
        let corners = (0..path.len().saturating_sub(1)).flat_map(quad).collect();
        Self { corners, colour }
    }

    /// Ring around a place on the ground.
    pub fn ring(centre: Vec3, radius: f32, width: f32, colour: [f32; 4]) -> Self {
        const SIDES: usize = 48;
        let place = |i: usize| {
            let angle = std::f32::consts::TAU * i as f32 / SIDES as f32;
            let way = Vec2::from_angle(angle) * radius;
            centre + Vec3::new(way.x, 0.0, way.y)
        };
        let path: Vec<Vec3> = (0..=SIDES).map(place).collect();
        Self::ribbon(&path, width, colour)
    }
}

impl Part<'_> {
    /// Checks that all arrays have an element for each vertex of the mesh.
    pub(crate) fn check(&self) -> Result<(), ViewerError> {
        let expected = self.mesh.vertex_count();
        let check = |what, found| match found == expected {
            true => Ok(()),
            false => Err(ViewerError::Length {
                what,
                expected,
                found,
            }),
        };
        match self.shape {
            Shape::Host(vertices) => check("vertices", vertices.len())?,
            Shape::Device { before, now, .. } => {
                for buffer in [before, now] {
                    check("vertices", buffer.size() as usize / size_of::<Vertex>())?;
                }
            }
        }
        self.colours
            .map_or(Ok(()), |colours| check("colours", colours.len()))
    }
}
