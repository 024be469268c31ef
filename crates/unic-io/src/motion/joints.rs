//! Which rotation of a frame turns which joint of the character: by name, wherever there are names.

use super::arrays::PoseLayout;
use crate::{error::Result, npz::Npz, retarget::is_same_joint};
use unic_core::skeleton::{SMPL_JOINT_NAMES, Skeleton};

/// Names of the joints that `poses` has, one a joint.
pub(crate) const JOINT_NAMES: &str = "joint_names";

/// Longest list of joints that an error repeats.
const QUOTED: usize = 6;

/// The joints that a motion is read for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Joints<'a> {
    /// So many, in the order of the file.
    Count(usize),
    /// A capture's own: in the order of the character where the file has no names.
    Own(&'a Skeleton),
    /// A character's that the file was not made for.
    Of(&'a Skeleton),
}

/// Which joint of the file turns which joint of the character.
#[derive(Debug)]
pub(super) struct Order {
    pub(super) sources: Sources,
    pub(super) layout: PoseLayout,
    pub(super) note: Option<String>,
}

/// For each joint of the character the joint of the file; none for a joint that the file does not turn.
#[derive(Debug)]
pub(super) enum Sources {
    /// The first `taken` of `joints` joints are those of the file. Nothing is allocated for them: a damaged file may
    /// claim any number.
    InOrder { joints: usize, taken: usize },
    /// Found by name.
    Named(Vec<Option<usize>>),
}

impl Sources {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::InOrder { joints, .. } => *joints,
            Self::Named(sources) => sources.len(),
        }
    }

    /// The joint of the file for a joint of the character.
    pub(super) fn of(&self, joint: usize) -> Option<usize> {
        match self {
            Self::InOrder { taken, .. } => (joint < *taken).then_some(joint),
            Self::Named(sources) => sources[joint],
        }
    }
}

impl Joints<'_> {
    fn len(&self) -> usize {
        match self {
            Joints::Count(count) => *count,
            Joints::Own(skeleton) | Joints::Of(skeleton) => skeleton.len(),
        }
    }

    fn skeleton(&self) -> Option<&Skeleton> {
        match self {
            Joints::Count(_) => None,
            Joints::Own(skeleton) | Joints::Of(skeleton) => Some(skeleton),
        }
    }
}

impl Order {
    /// The order of the array `poses` with so many numbers a frame.
    pub(super) fn of(npz: &mut Npz, poses: &str, numbers: usize, joints: &Joints) -> Result<Self> {
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
            Joints::Of(skeleton) if skeleton.len() == SMPL_JOINT_NAMES.len() => {
                Self::by_smpl_names(npz, layout, skeleton)
            }
            _ => Ok(Self::by_number(layout, joints.len())),
        }
    }

    fn by_number(layout: PoseLayout, joints: usize) -> Self {
        let taken = layout.joints_taken(joints);
        Self {
            sources: Sources::InOrder { joints, taken },
            layout,
            note: None,
        }
    }

    fn by_names(npz: &mut Npz, poses: &str, numbers: usize, skeleton: &Skeleton) -> Result<Self> {
        let names = npz.text(JOINT_NAMES)?;
        let layout = match numbers.checked_sub(3 * names.len()) {
            Some(0) => PoseLayout::Native,
            Some(3) if names.len() == SMPL_JOINT_NAMES.len() => PoseLayout::SmplWithTranslation,
            _ => {
                let expected = format!("3 numbers for each of the {} joint names", names.len());
                return Err(npz.array_error(poses, expected, format!("{numbers} numbers a frame")));
            }
        };
        let sources: Vec<Option<usize>> = skeleton.names().iter().map(|name| found(name, &names)).collect();
        refuse_missing(npz, skeleton, &sources, &names)?;
        refuse_twice(npz, skeleton, &sources, &names)?;
        let taken = sources.iter().flatten().count();
        let is_in_order = sources
            .iter()
            .enumerate()
            .all(|(joint, source)| *source == Some(joint));
        let note = (!is_in_order || names.len() > taken)
            .then(|| format!("{taken} of {} joints taken by their names", names.len()));
        Ok(Self {
            sources: Sources::Named(sources),
            layout,
            note,
        })
    }

    /// Frames without names are in the order of SMPL's joints; a character of as many joints may have others.
    fn by_smpl_names(npz: &Npz, layout: PoseLayout, skeleton: &Skeleton) -> Result<Self> {
        let by_number = Self::by_number(layout, skeleton.len());
        if skeleton.names() == SMPL_JOINT_NAMES || !is_named(skeleton) {
            return Ok(by_number);
        }
        let smpl = SMPL_JOINT_NAMES.map(str::to_owned);
        let sources: Option<Vec<usize>> = skeleton.names().iter().map(|name| found(name, &smpl)).collect();
        let Some(sources) = sources else {
            let names: Vec<&str> = skeleton.names().iter().map(String::as_str).collect();
            let expected = format!("joint names for the character's joints ({})", listed(&names));
            return Err(npz.array_error(JOINT_NAMES, expected, "none, and so SMPL's order"));
        };
        let taken = |joint: usize| by_number.sources.of(joint);
        Ok(Self {
            sources: Sources::Named(sources.into_iter().map(taken).collect()),
            note: Some("joints in SMPL's order taken by their names".to_owned()),
            layout,
        })
    }
}

/// Joints that carry no other, such as hands, may be missing: they do not turn.
fn refuse_missing(npz: &Npz, skeleton: &Skeleton, sources: &[Option<usize>], names: &[String]) -> Result<()> {
    let carries = |joint: usize| skeleton.parents().contains(&Some(joint));
    let missing: Vec<&str> = (skeleton.names().iter().zip(sources).enumerate())
        .filter(|(joint, (_, source))| source.is_none() && (carries(*joint) || skeleton.len() == 1))
        .map(|(_, (name, _))| name.as_str())
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let expected = format!("the character's joints, with {} among them", listed(&missing));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Err(npz.array_error(JOINT_NAMES, expected, listed(&names)))
}

/// Names that spelling alone tells apart may stand for one joint of the file.
fn refuse_twice(npz: &Npz, skeleton: &Skeleton, sources: &[Option<usize>], names: &[String]) -> Result<()> {
    let twice =
        |(joint, source): &(usize, &Option<usize>)| source.is_some() && sources[..*joint].contains(source);
    match sources.iter().enumerate().find(twice) {
        Some((joint, Some(source))) => {
            let expected = format!("a joint of its own for {}", skeleton.names()[joint]);
            let found = format!("{}, which stands for another already", names[*source]);
            Err(npz.array_error(JOINT_NAMES, expected, found))
        }
        _ => Ok(()),
    }
}

/// Joints that were given names, and not numbers for want of them.
fn is_named(skeleton: &Skeleton) -> bool {
    let numbered = |(joint, name): (usize, &String)| *name == format!("joint_{joint}");
    !skeleton.names().iter().enumerate().all(numbered)
}

/// The joint of the same name; else the one that only spelling, prefix or case tell apart.
fn found(name: &str, names: &[String]) -> Option<usize> {
    let same = names.iter().position(|other| other == name);
    same.or_else(|| names.iter().position(|other| is_same_joint(name, other)))
}

fn listed(names: &[&str]) -> String {
    match names.split_at_checked(QUOTED) {
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
