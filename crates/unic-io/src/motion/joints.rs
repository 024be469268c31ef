//! Mapping the joints of a motion file to those of the character: by name if there are names.

use super::layout::PoseLayout;
use crate::{
    error::Result,
    joint_names::{ARRAY_NAME as JOINT_NAMES, is_same_joint},
    npz::Npz,
};
use unic_core::skeleton::{SMPL_JOINT_NAMES, Skeleton};

/// Number of joint names that an error repeats.
const QUOTED_NAMES: usize = 6;

/// The joints that a motion is read for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum JointTarget<'a> {
    /// This many joints in the order of the file, of no known skeleton.
    Count(usize),
    /// The joints of a capture's character, whose clips without names are in its order.
    Capture(&'a Skeleton),
    /// The joints of a character that the file was not made for. A file without names is in SMPL's
    /// order.
    Character(&'a Skeleton),
}

/// Mapping from the joints of a file to those of the character.
#[derive(Debug)]
pub(super) struct JointMapping {
    pub(super) sources: JointSources,
    pub(super) layout: PoseLayout,
    pub(super) note: Option<String>,
}

/// The joint of the file for each joint of the character, if there is one.
#[derive(Debug)]
pub(super) enum JointSources {
    /// The first `taken` of `joints` joints are those of the file. The variant allocates nothing,
    /// because a damaged file may declare any number of joints.
    InOrder { joints: usize, taken: usize },
    /// Joints of the file found by name.
    Named(Vec<Option<usize>>),
}

impl JointSources {
    /// Number of joints of the character.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::InOrder { joints, .. } => *joints,
            Self::Named(sources) => sources.len(),
        }
    }

    /// Returns the joint of the file for a joint of the character.
    pub(super) fn of(&self, joint: usize) -> Option<usize> {
        match self {
            Self::InOrder { taken, .. } => (joint < *taken).then_some(joint),
            Self::Named(sources) => sources[joint],
        }
    }
}

impl JointTarget<'_> {
    fn len(&self) -> usize {
        match self {
            JointTarget::Count(count) => *count,
            JointTarget::Capture(skeleton) | JointTarget::Character(skeleton) => skeleton.len(),
        }
    }

    fn skeleton(&self) -> Option<&Skeleton> {
        match self {
            JointTarget::Count(_) => None,
            JointTarget::Capture(skeleton) | JointTarget::Character(skeleton) => Some(skeleton),
        }
    }
}

impl JointMapping {
    /// Maps the joints of the array `poses` with `numbers` values in a frame.
    ///
    /// # Errors
    /// Another number of joints than the names or the character have; missing or ambiguous names.
    pub(super) fn new(npz: &mut Npz, poses: &str, numbers: usize, joints: &JointTarget) -> Result<Self> {
        // Names are used only if the file and the character both have them.
        if let Some(skeleton) = joints.skeleton().filter(|skeleton| is_named(skeleton))
            && npz.contains(JOINT_NAMES)
        {
            return Self::by_names(npz, poses, numbers, skeleton);
        }
        let Some(layout) = PoseLayout::of(numbers, joints.len()) else {
            let expected = expected_numbers(joints.len());
            return Err(npz.array_error(poses, expected, format!("{numbers} numbers a frame")));
        };
        match joints {
            JointTarget::Character(skeleton) if skeleton.len() == SMPL_JOINT_NAMES.len() => {
                Self::by_smpl_names(npz, layout, skeleton)
            }
            _ => Ok(Self::by_number(layout, joints.len())),
        }
    }

    /// Maps joint by joint, in the order of the file.
    fn by_number(layout: PoseLayout, joints: usize) -> Self {
        let taken = layout.joints_taken(joints);
        Self {
            sources: JointSources::InOrder { joints, taken },
            layout,
            note: None,
        }
    }

    /// Maps by the names in the file.
    fn by_names(npz: &mut Npz, poses: &str, numbers: usize, skeleton: &Skeleton) -> Result<Self> {
        let names = npz.text(JOINT_NAMES)?;
        // The translation behind SMPL's rotations has no name.
        let layout = match numbers.checked_sub(3 * names.len()) {
            Some(0) => PoseLayout::Native,
            Some(3) if names.len() == SMPL_JOINT_NAMES.len() => PoseLayout::SmplWithTranslation,
            _ => {
                let expected = format!("3 numbers for each of the {} joint names", names.len());
                return Err(npz.array_error(poses, expected, format!("{numbers} numbers a frame")));
            }
        };
        let find = |name: &String| find_joint(name, &names);
        let sources: Vec<Option<usize>> = skeleton.names().iter().map(find).collect();
        refuse_missing(npz, skeleton, &sources, &names)?;
        refuse_ambiguous(npz, skeleton, &sources, &names)?;
        let taken = sources.iter().flatten().count();
        // The identity needs no note: it is what a file of this character has.
        let is_in_order = sources
            .iter()
            .enumerate()
            .all(|(joint, source)| *source == Some(joint));
        let note = (!is_in_order || names.len() > taken)
            .then(|| format!("{taken} of {} joints taken by their names", names.len()));
        Ok(Self {
            sources: JointSources::Named(sources),
            layout,
            note,
        })
    }

    /// Maps frames without names, which are in SMPL's order, by SMPL's names.
    ///
    /// A character of 24 joints may have them in another order than SMPL.
    fn by_smpl_names(npz: &Npz, layout: PoseLayout, skeleton: &Skeleton) -> Result<Self> {
        let by_number = Self::by_number(layout, skeleton.len());
        if skeleton.names() == SMPL_JOINT_NAMES || !is_named(skeleton) {
            return Ok(by_number);
        }
        let smpl = SMPL_JOINT_NAMES.map(str::to_owned);
        let find = |name: &String| find_joint(name, &smpl);
        let sources: Option<Vec<usize>> = skeleton.names().iter().map(find).collect();
        let Some(sources) = sources else {
            let names: Vec<&str> = skeleton.names().iter().map(String::as_str).collect();
            let expected = format!("joint names for the character's joints ({})", listed(&names));
            return Err(npz.array_error(JOINT_NAMES, expected, "none, and so SMPL's order"));
        };
        // SMPL-H and SMPL-X have fingers or the jaw at the places of SMPL's hands, so that these
        // joints have no source.
        let taken = |joint: usize| by_number.sources.of(joint);
        Ok(Self {
            sources: JointSources::Named(sources.into_iter().map(taken).collect()),
            note: Some("joints in SMPL's order taken by their names".to_owned()),
            layout,
        })
    }
}

/// Refuses names that lack a joint with children. Leaf joints, such as hands, may be missing and
/// then do not rotate.
fn refuse_missing(npz: &Npz, skeleton: &Skeleton, sources: &[Option<usize>], names: &[String]) -> Result<()> {
    // A skeleton of one joint is a leaf, but without a source nothing would move.
    let has_children = |joint: usize| skeleton.parents().contains(&Some(joint));
    let missing: Vec<&str> = (skeleton.names().iter().zip(sources).enumerate())
        .filter(|(joint, (_, source))| source.is_none() && (has_children(*joint) || skeleton.len() == 1))
        .map(|(_, (name, _))| name.as_str())
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let expected = format!("the character's joints, with {} among them", listed(&missing));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Err(npz.array_error(JOINT_NAMES, expected, listed(&names)))
}

/// Refuses two joints of the character that differ in spelling only and match one joint of the
/// file.
fn refuse_ambiguous(
    npz: &Npz,
    skeleton: &Skeleton,
    sources: &[Option<usize>],
    names: &[String],
) -> Result<()> {
    let is_second =
        |(joint, source): &(usize, &Option<usize>)| source.is_some() && sources[..*joint].contains(source);
    match sources.iter().enumerate().find(is_second) {
        Some((joint, Some(source))) => {
            let expected = format!("a joint of its own for {}", skeleton.names()[joint]);
            let found = format!("{}, which stands for another already", names[*source]);
            Err(npz.array_error(JOINT_NAMES, expected, found))
        }
        _ => Ok(()),
    }
}

/// Returns whether the joints are SMPL's by their names, in any order, or have no names that tell.
pub(super) fn is_in_smpl_terms(skeleton: &Skeleton) -> bool {
    let smpl = SMPL_JOINT_NAMES.map(str::to_owned);
    let is_known = |name: &String| find_joint(name, &smpl).is_some();
    let is_smpl = skeleton.len() == smpl.len() && skeleton.names().iter().all(is_known);
    is_smpl || !is_named(skeleton)
}

/// Returns whether the joints have names of a file. Joints without names are called `joint_0`,
/// `joint_1`, ...
fn is_named(skeleton: &Skeleton) -> bool {
    let numbered = |(joint, name): (usize, &String)| *name == format!("joint_{joint}");
    !skeleton.names().iter().enumerate().all(numbered)
}

/// Finds the joint of the same name, else one whose name differs in case, prefix or separators
/// only.
fn find_joint(name: &str, names: &[String]) -> Option<usize> {
    // The exact name first: joints that differ in spelling only may exist side by side.
    let same = names.iter().position(|other| other == name);
    same.or_else(|| names.iter().position(|other| is_same_joint(name, other)))
}

fn listed(names: &[&str]) -> String {
    match names.split_at_checked(QUOTED_NAMES) {
        Some((first, more)) if !more.is_empty() => format!("{} and {} more", first.join(", "), more.len()),
        _ => names.join(", "),
    }
}

fn expected_numbers(joints: usize) -> String {
    let own = 3 * joints;
    if joints == SMPL_JOINT_NAMES.len() {
        format!("{own}, 75, 156 or 165 numbers a frame")
    } else {
        format!("{own} numbers a frame for {joints} joints")
    }
}
