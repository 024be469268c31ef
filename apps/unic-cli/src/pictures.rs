//! Sheets of pictures of a garment on a body.

use anyhow::Result;
use glam::{Quat, Vec2, Vec3};
use unic_core::{
    character::{Character, Garment},
    mesh::TriMesh,
    skeleton::{Pose, Skeleton},
};
use unic_viewer::{Camera, Colouring, Ground, Image, Scene, Surface, captioned, render, vertex_normals};

/// Pixels of one picture of a sheet.
const SIZE: [u32; 2] = [300, 420];
/// Pixels between pictures.
pub(crate) const GAP: u32 = 6;
/// sRGB.
pub(crate) const SKIN: [f32; 3] = [0.82, 0.68, 0.59];
/// sRGB.
pub(crate) const CLOTH: Colouring = Colouring::Solid([0.25, 0.42, 0.66]);
/// From where the character faces, a little to its left and from above, radians.
const AZIMUTH: f32 = 0.45;
const ELEVATION: f32 = 0.15;
/// How far a garment may reach beyond the body and still be framed, metres: a garment that has
/// flown away must not make the character a dot.
const REACH_M: f32 = 0.5;
/// How much of its surroundings a view of the garment shows, in sizes of the garment.
const SURROUNDINGS: f32 = 1.2;

/// One moment: body and garment, metres, world space.
#[derive(Clone, Debug)]
pub(crate) struct Shot {
    /// Vertices of the body.
    pub(crate) body: Vec<Vec3>,
    /// Vertices of the garment.
    pub(crate) garment: Vec<Vec3>,
    /// Where the character is.
    pub(crate) place: Place,
}

/// Where a character is, seen from above.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// The root joint, moved down to height 0: what the camera follows.
    anchor: Vec3,
    /// Yaw from +Z towards +X, radians.
    facing: f32,
}

impl Place {
    /// Of a pose.
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

/// What a picture shows all of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Framing {
    /// The character from head to foot, with the garment.
    Figure,
    /// The garment, and as much of the body as is near it.
    Garment,
}

/// Colours of a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Paint<'a> {
    /// sRGB.
    pub(crate) skin: [f32; 3],
    /// Of the garment.
    pub(crate) cloth: Colouring<'a>,
}

/// Draws shots of one character, all from the same side and at the same size.
pub(crate) struct Studio<'a> {
    body: &'a TriMesh,
    garment: &'a TriMesh,
    ground_height: f32,
    camera: Camera,
    size: [u32; 2],
}

impl<'a> Studio<'a> {
    /// A camera that fits all the shots.
    pub(crate) fn new(
        character: &'a Character,
        garment: &'a Garment,
        ground_height: f32,
        shots: &[Shot],
    ) -> Result<Self> {
        let (min, max) = bounds(shots);
        let facing = shots.first().map_or(0.0, |shot| shot.place.facing);
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let camera = Camera::framing(min, max, facing + AZIMUTH, ELEVATION, aspect)?;
        Ok(Self {
            body: &character.body,
            garment: &garment.rest,
            ground_height,
            camera,
            size: SIZE,
        })
    }

    /// A studio for pictures of another size whose camera comes as close as the shots allow.
    pub(crate) fn close(
        character: &'a Character,
        garment: &'a Garment,
        ground_height: f32,
        shots: &[Shot],
        (framing, size): (Framing, [u32; 2]),
    ) -> Result<Self> {
        let points: Vec<Vec3> = shots.iter().flat_map(|shot| outline(shot, framing)).collect();
        let aspect = size[0] as f32 / size[1] as f32;
        let azimuth = mean_facing(shots) + AZIMUTH;
        // A shot with nothing finite in it is drawn as an empty stage.
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

    /// One shot with a line of text above.
    pub(crate) fn picture(&self, shot: &Shot, cloth: Colouring, caption: &str) -> Result<Image> {
        let image = self.draw(shot, Paint { skin: SKIN, cloth })?;
        Ok(captioned(&image, caption)?)
    }

    /// One shot.
    pub(crate) fn draw(&self, shot: &Shot, paint: Paint) -> Result<Image> {
        let body_normals = vertex_normals(&shot.body, &self.body.faces)?;
        let garment_normals = vertex_normals(&shot.garment, &self.garment.faces)?;
        let surfaces = [
            Surface {
                vertices: &shot.body,
                faces: &self.body.faces,
                normals: &body_normals,
                colour: Colouring::Solid(paint.skin),
            },
            Surface {
                vertices: &shot.garment,
                faces: &self.garment.faces,
                normals: &garment_normals,
                colour: paint.cloth,
            },
        ];
        let mut scene = Scene::new(&surfaces);
        scene.ground = Ground::Height(self.ground_height);
        let camera = self.camera.moved_by(shot.place.anchor);
        Ok(render(&scene, &camera, self.size[0], self.size[1])?)
    }
}

/// Points that a camera must see, from the shot's anchor.
fn outline(shot: &Shot, framing: Framing) -> Vec<Vec3> {
    let anchor = shot.place.anchor;
    let near: Vec<Vec3> = near_garment(shot).map(|v| v - anchor).collect();
    match framing {
        Framing::Figure => shot.body.iter().map(|v| v - anchor).chain(near).collect(),
        Framing::Garment => {
            let bounds = Bounds::of(&near);
            let centre = (bounds.min + bounds.max) * 0.5;
            near.iter()
                .map(|v| centre + (v - centre) * SURROUNDINGS)
                .collect()
        }
    }
}

/// Vertices of the garment, those out of reach drawn in to where the reach ends.
fn near_garment(shot: &Shot) -> impl Iterator<Item = Vec3> {
    let body = Bounds::of(&shot.body);
    let (min, max) = (body.min - REACH_M, body.max + REACH_M);
    let garment = shot.garment.iter().filter(|v| v.is_finite());
    garment.map(move |v| v.clamp(min, max.max(min)))
}

/// The direction that a character faces on the whole, radians.
fn mean_facing(shots: &[Shot]) -> f32 {
    let directions = shots.iter().map(|shot| Vec2::from_angle(shot.place.facing));
    directions.sum::<Vec2>().to_angle()
}

/// The first frame, the last one, and others between.
pub(crate) fn evenly_spread(len: usize, count: usize) -> Vec<usize> {
    let mut frames: Vec<usize> = (0..count)
        .map(|i| i * len.saturating_sub(1) / (count - 1).max(1))
        .collect();
    frames.dedup();
    frames
}

/// Box around all shots, seen from their anchors.
fn bounds(shots: &[Shot]) -> (Vec3, Vec3) {
    let mut all = Bounds::EMPTY;
    for shot in shots {
        let shot_bounds = near_garment(shot).fold(Bounds::of(&shot.body), Bounds::with);
        all = all
            .with(shot_bounds.min - shot.place.anchor)
            .with(shot_bounds.max - shot.place.anchor);
    }
    match all.min.cmple(all.max).all() && all.min.is_finite() && all.max.is_finite() {
        true => (all.min, all.max),
        false => (-Vec3::ONE, Vec3::ONE),
    }
}

#[derive(Clone, Copy)]
struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

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
    fn a_garment_that_flies_away_does_not_shrink_the_picture() {
        let body = [Vec3::ZERO, Vec3::ONE];
        let shot = |far: Vec3, anchor: Vec3| Shot {
            body: body.iter().map(|v| v + anchor).collect(),
            garment: vec![far, Vec3::NAN],
            place: Place { anchor, facing: 0.0 },
        };
        let shots = [
            shot(Vec3::splat(1e9), Vec3::ZERO),
            shot(Vec3::X * 20.5, Vec3::X * 20.0),
        ];
        assert_eq!(bounds(&shots), (Vec3::ZERO, Vec3::splat(1.5)));
        assert_eq!(bounds(&[]), (-Vec3::ONE, Vec3::ONE));
    }

    #[test]
    fn pictures_are_spread_over_any_clip() {
        assert_eq!(evenly_spread(15, 8), [0, 2, 4, 6, 8, 10, 12, 14]);
        assert_eq!(evenly_spread(2, 8), [0, 1]);
        assert_eq!(evenly_spread(1, 8), [0]);
    }
}
