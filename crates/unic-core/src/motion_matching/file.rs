//! File of a database: a header in JSON and flat arrays behind it.
//!
//! docs/reference/motion-database.md describes the format.

use super::{
    build::searchable,
    content::{check_arrays, check_joints, check_tags},
    database::{Database, DatabaseSettings, Frames, StoredClip},
    error::DatabaseError,
    features::{FeatureScale, feature_len},
    index::FeatureIndex,
    root::RootFrame,
};
use crate::{
    printable::printable_excerpt,
    skeleton::{Skeleton, SkeletonParts},
};
use bytemuck::{AnyBitPattern, NoUninit};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// First bytes of the file.
pub const MAGIC: [u8; 8] = *b"UNICMOTN";
/// Version that this build writes, and the only one that it reads.
pub const FORMAT_VERSION: u32 = 1;
/// Bytes before the header: magic, version, checksum, length of the header, zero.
const PREFIX: usize = 24;
/// Bytes that the checksum does not cover: magic, version and itself.
const UNCHECKED: usize = 16;
/// Multiple of bytes at which the arrays begin.
const ALIGNMENT: usize = 16;

/// Error: bytes that are not a readable motion database.
#[derive(Debug, Error)]
pub enum DatabaseFileError {
    /// Bytes of another kind.
    #[error("expected a motion database, which begins with UNICMOTN, found other bytes")]
    Magic,
    /// A file of another format version.
    #[error("expected motion database version {expected}, found {found}; build it again")]
    Version {
        /// Version that this build reads.
        expected: u32,
        /// Version of the file.
        found: u32,
    },
    /// Bytes that have changed since they were written.
    #[error("the file is damaged: expected its bytes to have the checksum {expected:08x}, found {found:08x}")]
    Damaged {
        /// Checksum that the file states.
        expected: u32,
        /// Checksum of the file's bytes.
        found: u32,
    },
    /// A file of another length than its header states.
    #[error("expected {expected} bytes of a motion database, found {found}")]
    Length {
        /// Bytes by the header.
        expected: u64,
        /// Bytes of the file.
        found: u64,
    },
    /// A header that is not JSON of the expected form.
    #[error("expected the header of a motion database, found JSON that is not: {}", printable_excerpt(&.0.to_string()))]
    Header(#[from] serde_json::Error),
    /// Clips that do not lie one behind the other, or numbers that are not usable.
    #[error("motion database: expected usable {what}, found some that are not")]
    Content {
        /// Name of the part.
        what: &'static str,
    },
    /// Settings or joints that do not make a database.
    #[error(transparent)]
    Database(#[from] DatabaseError),
}

/// Whether a checksum is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChecksumRule {
    /// Damaged files are refused.
    Compare,
    /// For tests of the checks behind it.
    Ignore,
}

/// JSON header.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    frames: usize,
    fps: f32,
    joint_names: Vec<String>,
    parents: Vec<i64>,
    joints: Vec<Vec3>,
    rest_pose: Vec<Vec3>,
    tags: Vec<String>,
    clips: Vec<StoredClip>,
    settings: DatabaseSettings,
}

impl Database {
    /// Returns the bytes of the file. The same database always gives the same bytes.
    ///
    /// # Errors
    /// A header that cannot be serialised, which a checked database does not cause.
    pub fn to_bytes(&self) -> Result<Vec<u8>, DatabaseFileError> {
        let parts = self.skeleton.to_parts();
        let header = serde_json::to_vec(&Header {
            frames: self.len(),
            fps: self.fps,
            joint_names: parts.names,
            parents: parts.parents,
            joints: parts.joints,
            rest_pose: parts.rest_pose,
            tags: self.tag_names.clone(),
            clips: self.clips.clone(),
            settings: self.settings.clone(),
        })?;
        let mut bytes = Vec::new();
        bytes.extend(MAGIC);
        bytes.extend(FORMAT_VERSION.to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend((header.len() as u32).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(header);
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), b' ');
        self.append_arrays(&mut bytes);
        let checksum = crc32fast::hash(&bytes[UNCHECKED..]);
        bytes[UNCHECKED - 4..UNCHECKED].copy_from_slice(&checksum.to_le_bytes());
        Ok(bytes)
    }

    fn append_arrays(&self, bytes: &mut Vec<u8>) {
        let frames = &self.frames;
        append(bytes, &frames.roots);
        append(bytes, &frames.hips);
        append(bytes, &frames.rotations);
        append(bytes, &frames.tags);
        append(bytes, &frames.contacts);
        append(bytes, &self.scale.means);
        append(bytes, &self.scale.scales);
        for frame in 0..self.len() {
            let row: Vec<f32> = self.features(frame).collect();
            append(bytes, &row);
        }
    }

    /// Reads a database from the bytes of its file.
    ///
    /// No bytes make this panic or allocate memory out of proportion to their number.
    ///
    /// # Errors
    /// Bytes that are not a database of this format version, or were damaged. The error names what
    /// was expected and found, and leaves the file's name to the caller.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, DatabaseFileError> {
        Self::from_bytes_with(bytes, ChecksumRule::Compare)
    }

    /// Reads a database like [`Database::from_bytes`], with or without the comparison with its
    /// checksum.
    ///
    /// # Errors
    /// The errors of [`Database::from_bytes`].
    pub fn from_bytes_with(bytes: &[u8], rule: ChecksumRule) -> Result<Self, DatabaseFileError> {
        let (header, arrays) = split(bytes, rule)?;
        let skeleton = Skeleton::new(SkeletonParts {
            names: header.joint_names,
            parents: header.parents,
            joints: header.joints,
            rest_pose: header.rest_pose,
        })
        .map_err(DatabaseError::from)?;
        header.settings.check(&skeleton)?;
        check_joints(&skeleton)?;
        check_tags(&header.tags)?;
        if !(1.0..=1000.0).contains(&header.fps) {
            return Err(DatabaseFileError::Content { what: "frame rate" });
        }
        check_clips(&header.clips, header.frames)?;
        let sizes = Sizes {
            frames: header.frames,
            joints: skeleton.len(),
            features: feature_len(&header.settings.groups),
        };
        sizes.check(bytes.len() - arrays.len(), bytes.len())?;
        let Arrays { frames, scale, rows } = Arrays::read(&sizes, arrays);
        check_arrays(&frames, &scale, &rows)?;
        let is_searchable = searchable(&header.clips, header.settings.end_margin_s * header.fps);
        if !is_searchable.contains(&true) {
            return Err(DatabaseError::NoFrames.into());
        }
        Ok(Self {
            index: FeatureIndex::new(sizes.features, &rows, &is_searchable),
            skeleton,
            settings: header.settings,
            fps: header.fps,
            tag_names: header.tags,
            clips: header.clips,
            frames,
            scale,
        })
    }
}

fn append<T: NoUninit>(bytes: &mut Vec<u8>, values: &[T]) {
    // All supported processors are little-endian, as the file is.
    bytes.extend_from_slice(bytemuck::cast_slice(values));
}

/// Splits a file into its header and its arrays.
fn split(bytes: &[u8], rule: ChecksumRule) -> Result<(Header, &[u8]), DatabaseFileError> {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap_or_default());
    if bytes.len() < PREFIX || bytes[..MAGIC.len()] != MAGIC {
        return Err(DatabaseFileError::Magic);
    }
    match word(8) {
        FORMAT_VERSION => {}
        found => {
            return Err(DatabaseFileError::Version {
                expected: FORMAT_VERSION,
                found,
            });
        }
    }
    let (expected, found) = (word(UNCHECKED - 4), crc32fast::hash(&bytes[UNCHECKED..]));
    if rule == ChecksumRule::Compare && expected != found {
        return Err(DatabaseFileError::Damaged { expected, found });
    }
    let header = word(UNCHECKED) as usize;
    let arrays = (PREFIX + header).next_multiple_of(ALIGNMENT);
    if arrays > bytes.len() {
        return Err(DatabaseFileError::Length {
            expected: arrays as u64,
            found: bytes.len() as u64,
        });
    }
    Ok((
        serde_json::from_slice(&bytes[PREFIX..PREFIX + header])?,
        &bytes[arrays..],
    ))
}

/// Checks that clips of two frames or more lie one behind the other, up to the last frame.
fn check_clips(clips: &[StoredClip], frames: usize) -> Result<(), DatabaseFileError> {
    let mut end = 0usize;
    for clip in clips {
        let is_next = clip.first == end && clip.len >= 2;
        end = match end.checked_add(clip.len) {
            Some(end) if is_next && end <= frames => end,
            _ => return Err(DatabaseFileError::Content { what: "clips" }),
        };
    }
    match end == frames {
        true => Ok(()),
        false => Err(DatabaseFileError::Content { what: "clips" }),
    }
}

/// Sizes of the arrays.
#[derive(Clone, Copy)]
struct Sizes {
    frames: usize,
    joints: usize,
    features: usize,
}

impl Sizes {
    /// Compares the length of the file with the sizes, before anything of these sizes is allocated.
    fn check(&self, before: usize, found: usize) -> Result<(), DatabaseFileError> {
        let [frames, joints, features] = [self.frames, self.joints, self.features].map(|n| n as u128);
        // In u128, which no sizes overflow that fit into a header.
        let words = frames * (3 + 3 + 4 * joints + 2 + features) + 2 * features;
        let expected = before as u128 + 4 * words;
        match expected == found as u128 {
            true => Ok(()),
            false => Err(DatabaseFileError::Length {
                expected: u64::try_from(expected).unwrap_or(u64::MAX),
                found: found as u64,
            }),
        }
    }
}

/// Arrays of a file.
struct Arrays {
    frames: Frames,
    scale: FeatureScale,
    rows: Vec<f32>,
}

impl Arrays {
    fn read(sizes: &Sizes, mut rest: &[u8]) -> Self {
        let Sizes {
            frames,
            joints,
            features,
        } = *sizes;
        Self {
            frames: Frames {
                roots: take::<RootFrame>(&mut rest, frames),
                hips: take::<Vec3>(&mut rest, frames),
                rotations: take::<Quat>(&mut rest, frames * joints),
                tags: take(&mut rest, frames),
                contacts: take(&mut rest, frames),
            },
            scale: FeatureScale {
                means: take(&mut rest, features),
                scales: take(&mut rest, features),
            },
            rows: take(&mut rest, frames * features),
        }
    }
}

/// Takes `count` values from the front. The bytes need no alignment.
fn take<T: AnyBitPattern>(rest: &mut &[u8], count: usize) -> Vec<T> {
    let (values, behind) = rest.split_at(count * size_of::<T>());
    *rest = behind;
    values
        .chunks_exact(size_of::<T>())
        .map(bytemuck::pod_read_unaligned)
        .collect()
}
