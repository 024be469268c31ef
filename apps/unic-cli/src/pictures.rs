//! Pictures of a garment on a body, for strips, sheets and movies.

use anyhow::Result;
use glam::{Quat, Vec2, Vec3};
use unic_core::{
    Pose,
    character::{Character, Garment},
    mesh::TriMesh,
    skeleton::Skeleton,
};
use unic_raster::{Camera, Colouring, Ground, Image, Scene, Surface, captioned, render, vertex_normals};

/// Width and height of one picture of a strip or sheet, in pixels.
const SIZE: [u32; 2] = [300, 420];
/// Gap between pictures in pixels.
pub(crate) const GAP: u32 = 6;
/// Colour of the skin, sRGB.
pub(crate) const SKIN: [f32; 3] = [0.82, 0.68, 0.59];
/// Colour of the garment, sRGB.
pub(crate) const CLOTH: Colouring = Colouring::Solid([0.25, 0.42, 0.66]);
/// Azimuth of the camera from the direction that the character faces towards its left, radians.
const AZIMUTH: f32 = 0.45;
/// Elevation of the camera over the horizontal, radians.
const ELEVATION: f32 = 0.15;
/// Distance in metres from the bounding box of the body within which the garment is framed.
// A garment that diverges must not shrink the character to a dot.
const REACH_M: f32 = 0.5;
/// Size of a close-up of the garment, relative to the garment.
const CLOSE_UP_SCALE: f32 = 1.2;

/// Positions of body and garment in one frame, in metres and world space.
#[derive(Clone, Debug)]
pub(crate) struct Snapshot {
    /// Vertices of the body.
    pub(crate) body: Vec<Vec3>,
    /// Vertices of the garment.
    pub(crate) garment: Vec<Vec3>,
    /// Position and direction of the character.
    pub(crate) placement: Placement,
}

/// Snapshot with the index of its frame.
#[derive(Clone, Debug)]
pub(crate) struct FrameSnapshot {
    /// Frame of the clip, from 0.
    pub(crate) frame: usize,
    /// Positions in that frame.
    pub(crate) snapshot: Snapshot,
}

/// Position and direction of a character on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// Root joint, moved down to height 0. The camera follows it.
    anchor: Vec3,
    /// Yaw from +Z towards +X, radians.
    facing: f32,
}

impl Placement {
    /// Computes the placement of a pose.
    pub(crate) fn new(skeleton: &Skeleton, pose: &Pose) -> Self {
        let root = skeleton.root();
        let at_bind = skeleton.joints().get(root).copied().unwrap_or_default();
        let world_from_root = pose.local.get(root).copied().unwrap_or_default();
        let bind_from_root = skeleton
            .rest_pose()
            .get(root)
            .map_or(Quat::IDENTITY, |r| Quat::from_scaled_axis(*r));
        // Characters face +Z in their bind pose.
        let forward = world_from_root * bind_from_root.inverse() * Vec3::Z;
        Self {
            anchor: (at_bind + pose.trans).with_y(0.0),
            facing: forward.x.atan2(forward.z),
        }
    }
}

/// Part of a snapshot that a picture shows completely.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Framing {
    /// The character from head to foot, with the garment.
    Figure,
    /// The garment, with the parts of the body that are near it.
    Garment,
}

/// Framing and size of pictures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureView {
    /// Part of the snapshots that is in view.
    pub(crate) framing: Framing,
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
}

/// Colours of a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paint<'a> {
    /// Colour of the skin, sRGB.
    pub(crate) skin: [f32; 3],
    /// Colours of the garment.
    pub(crate) cloth: Colouring<'a>,
}

/// Draws snapshots of one character, all from the same direction and at the same scale.
pub(crate) struct Renderer<'a> {
    body: &'a TriMesh,
    garment: &'a TriMesh,
    ground_height: f32,
    camera: Camera,
    size: [u32; 2],
}

impl<'a> Renderer<'a> {
    /// Creates a renderer whose camera has all snapshots in view.
    ///
    /// # Errors
    /// A camera that cannot be placed.
    pub(crate) fn new(
        character: &'a Character,
        garment: &'a Garment,
        ground_height: f32,
        snapshots: &[Snapshot],
    ) -> Result<Self> {
        let bounds = bounds(snapshots);
        let facing = snapshots.first().map_or(0.0, |first| first.placement.facing);
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let camera = Camera::framing(bounds.min, bounds.max, facing + AZIMUTH, ELEVATION, aspect)?;
        Ok(Self {
            body: &character.body,
            garment: &garment.rest,
            ground_height,
            camera,
            size: SIZE,
        })
    }

    /// Creates a renderer whose camera is as close as the snapshots allow.
    ///
    /// # Errors
    /// A camera that cannot be placed.
    pub(crate) fn close(
        character: &'a Character,
        garment: &'a Garment,
        ground_height: f32,
        snapshots: &[Snapshot],
        view: PictureView,
    ) -> Result<Self> {
        let PictureView { framing, size } = view;
        let points: Vec<Vec3> = (snapshots.iter())
            .flat_map(|snapshot| points_in_view(snapshot, framing))
            .collect();
        let aspect = size[0] as f32 / size[1] as f32;
        // The mean over all snapshots, since the character may turn while the camera does not.
        let azimuth = mean_facing(snapshots) + AZIMUTH;
        // A snapshot without finite positions is drawn as an empty scene.
        let camera = Camera::around(&points, azimuth, ELEVATION, aspect)
            .or_else(|_| Camera::framing(-Vec3::ONE, Vec3::ONE, azimuth, ELEVATION, aspect))?;
        Ok(Self {
            body: &character.body,
            garment: &garment.rest,
            ground_height,
            camera,
            size,
        })
    }

    /// Draws a snapshot with a line of text above it.
    pub(crate) fn picture(&self, snapshot: &Snapshot, cloth: Colouring, caption: &str) -> Result<Image> {
        let image = self.draw(snapshot, Paint { skin: SKIN, cloth })?;
        Ok(captioned(&image, caption)?)
    }

    /// Draws a snapshot.
    pub(crate) fn draw(&self, snapshot: &Snapshot, paint: Paint) -> Result<Image> {
        let body_normals = vertex_normals(&snapshot.body, &self.body.faces)?;
        let garment_normals = vertex_normals(&snapshot.garment, &self.garment.faces)?;
        let surfaces = [
            Surface {
                vertices: &snapshot.body,
                faces: &self.body.faces,
                normals: &body_normals,
                colour: Colouring::Solid(paint.skin),
            },
            Surface {
                vertices: &snapshot.garment,
                faces: &self.garment.faces,
                normals: &garment_normals,
                colour: paint.cloth,
            },
        ];
        let mut scene = Scene::new(&surfaces);
        scene.ground = Ground::Height(self.ground_height);
        Ok(render(
            &scene,
            &self.camera_of(snapshot),
            self.size[0],
            self.size[1],
        )?)
    }

    /// Camera of a snapshot. It moves with the character and does not turn with it.
    pub(crate) fn camera_of(&self, snapshot: &Snapshot) -> Camera {
        self.camera.moved_by(snapshot.placement.anchor)
    }

    /// Width and height of the pictures, pixels.
    #[cfg(feature = "viewer")]
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Mesh of the body.
    #[cfg(feature = "viewer")]
    pub(crate) fn body(&self) -> &TriMesh {
        self.body
    }

    /// Mesh of the garment.
    #[cfg(feature = "viewer")]
    pub(crate) fn garment(&self) -> &TriMesh {
        self.garment
    }

    /// Height of the ground, metres.
    #[cfg(feature = "viewer")]
    pub(crate) fn ground_height(&self) -> f32 {
        self.ground_height
    }
}

/// Points that the camera must see, relative to the anchor of the snapshot.
fn points_in_view(snapshot: &Snapshot, framing: Framing) -> Vec<Vec3> {
    let anchor = snapshot.placement.anchor;
    let near: Vec<Vec3> = near_garment(snapshot).map(|v| v - anchor).collect();
    match framing {
        Framing::Figure => snapshot.body.iter().map(|v| v - anchor).chain(near).collect(),
        Framing::Garment => {
            let bounds = Bounds::of(&near);
            let centre = (bounds.min + bounds.max) * 0.5;
            near.iter()
                .map(|v| centre + (v - centre) * CLOSE_UP_SCALE)
                .collect()
        }
    }
}

/// Finite vertices of the garment, clamped to the bounding box of the body enlarged by [`REACH_M`].
fn near_garment(snapshot: &Snapshot) -> impl Iterator<Item = Vec3> {
    let body = Bounds::of(&snapshot.body);
    let (min, max) = (body.min - REACH_M, body.max + REACH_M);
    let garment = snapshot.garment.iter().filter(|v| v.is_finite());
    // A body without finite vertices gives min > max, for which `clamp` is not defined.
    garment.map(move |v| v.clamp(min, max.max(min)))
}

/// Mean direction that the character faces, radians.
fn mean_facing(snapshots: &[Snapshot]) -> f32 {
    // Unit vectors are summed, for a mean of angles fails where they pass from +π to -π.
    let directions = (snapshots.iter()).map(|snapshot| Vec2::from_angle(snapshot.placement.facing));
    directions.sum::<Vec2>().to_angle()
}

/// Indices of at most `count` of `len` frames at even distances: the first, the last, others
/// between.
pub(crate) fn evenly_spread(len: usize, count: usize) -> Vec<usize> {
    let mut frames: Vec<usize> = (0..count)
        .map(|i| i * len.saturating_sub(1) / (count - 1).max(1))
        .collect();
    // Short clips have fewer frames than pictures.
    frames.dedup();
    frames
}

/// Bounding box of all snapshots, each relative to its anchor. Never empty.
fn bounds(snapshots: &[Snapshot]) -> Bounds {
    let mut all = Bounds::EMPTY;
    for snapshot in snapshots {
        let own = near_garment(snapshot).fold(Bounds::of(&snapshot.body), Bounds::with);
        all = all
            .with(own.min - snapshot.placement.anchor)
            .with(own.max - snapshot.placement.anchor);
    }
    match all.min.cmple(all.max).all() && all.min.is_finite() && all.max.is_finite() {
        true => all,
        // Nothing to see: any box serves for an empty picture.
        false => Bounds {
            min: -Vec3::ONE,
            max: Vec3::ONE,
        },
    }
}

/// Axis-aligned bounding box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Bounding box of the finite points; [`Bounds::EMPTY`] if there are none.
    fn of(points: &[Vec3]) -> Self {
        points
            .iter()
            .filter(|v| v.is_finite())
            .copied()
            .fold(Self::EMPTY, Self::with)
    }

    fn with(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_garment_that_diverges_does_not_shrink_the_picture() {
        let body = [Vec3::ZERO, Vec3::ONE];
        let snapshot = |far: Vec3, anchor: Vec3| Snapshot {
            body: body.iter().map(|v| v + anchor).collect(),
            garment: vec![far, Vec3::NAN],
            placement: Placement { anchor, facing: 0.0 },
        };
        let snapshots = [
            snapshot(Vec3::splat(1e9), Vec3::ZERO),
            snapshot(Vec3::X * 20.5, Vec3::X * 20.0),
        ];
        let expected = |min, max| Bounds { min, max };
        assert_eq!(bounds(&snapshots), expected(Vec3::ZERO, Vec3::splat(1.5)));
        assert_eq!(bounds(&[]), expected(-Vec3::ONE, Vec3::ONE));
    }

    #[test]
    fn pictures_are_spread_evenly_over_clips_of_any_length() {
        assert_eq!(evenly_spread(15, 8), [0, 2, 4, 6, 8, 10, 12, 14]);
        assert_eq!(evenly_spread(2, 8), [0, 1]);
        assert_eq!(evenly_spread(1, 8), [0]);
    }
}
