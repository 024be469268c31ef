//! The grammar.

use super::{Axis, Bvh, BvhJoint, Channel, tokens::Tokens};
use crate::{
    error::{Error, Result},
    motion::check_frame_rate,
};
use glam::Vec3;
use std::{collections::HashSet, path::Path};

/// More than any joint needs: three positions, three rotations.
const MOST_CHANNELS: usize = 6;

/// Longest part of a wrong word that an error repeats, characters.
const QUOTED: usize = 40;

pub(super) fn parse(path: &Path, text: &str) -> Result<Bvh> {
    let mut parser = Parser {
        path,
        tokens: Tokens::new(text),
        joints: Vec::new(),
        names: HashSet::new(),
        channels: 0,
    };
    parser.hierarchy()?;
    parser.motion()
}

struct Parser<'a> {
    path: &'a Path,
    tokens: Tokens<'a>,
    joints: Vec<BvhJoint>,
    names: HashSet<String>,
    /// Numbers a frame so far.
    channels: usize,
}

impl<'a> Parser<'a> {
    fn hierarchy(&mut self) -> Result<()> {
        self.keyword("HIERARCHY")?;
        self.keyword("ROOT")?;
        self.open_joint(None)?;
        // The chain of joints whose braces are open: nesting of any depth without recursion.
        let mut open = vec![0];
        while let Some(&joint) = open.last() {
            let word = self.word("JOINT, End Site or }")?;
            if word == "}" {
                open.pop();
            } else if word.eq_ignore_ascii_case("JOINT") {
                open.push(self.open_joint(Some(joint))?);
            } else if word.eq_ignore_ascii_case("End") {
                let site = self.end_site()?;
                self.joints[joint].end_sites.push(site);
            } else {
                return Err(self.wrong("JOINT, End Site or }", word));
            }
        }
        Ok(())
    }

    /// From the name to the channels; the closing brace is the caller's.
    fn open_joint(&mut self, parent: Option<usize>) -> Result<usize> {
        let name = self.tokens.name().to_owned();
        if name.is_empty() {
            return Err(self.wrong("the name of a joint", "none"));
        }
        if !self.names.insert(name.clone()) {
            return Err(self.wrong("joints of different names", &name));
        }
        self.keyword("{")?;
        let offset = self.offset()?;
        let first_channel = self.channels;
        let channels = self.channels()?;
        self.channels += channels.len();
        self.joints.push(BvhJoint {
            name,
            parent,
            offset,
            channels,
            end_sites: Vec::new(),
            first_channel,
        });
        Ok(self.joints.len() - 1)
    }

    fn offset(&mut self) -> Result<Vec3> {
        self.keyword("OFFSET")?;
        let mut offset = Vec3::ZERO;
        for axis in 0..3 {
            offset[axis] = self.number()?;
        }
        Ok(offset)
    }

    fn channels(&mut self) -> Result<Vec<Channel>> {
        self.keyword("CHANNELS")?;
        let expected = "a number of channels from 0 to 6";
        let count = self.whole(expected)?;
        if count > MOST_CHANNELS {
            return Err(self.wrong(expected, &count.to_string()));
        }
        (0..count).map(|_| self.channel()).collect()
    }

    fn channel(&mut self) -> Result<Channel> {
        let expected = "a channel such as Xposition or Zrotation";
        let word = self.word(expected)?;
        channel(word).ok_or_else(|| self.wrong(expected, word))
    }

    fn end_site(&mut self) -> Result<Vec3> {
        // "End Site" and then, from some programs, a name.
        self.tokens.name();
        self.keyword("{")?;
        let site = self.offset()?;
        self.keyword("}")?;
        Ok(site)
    }

    fn motion(mut self) -> Result<Bvh> {
        self.keyword("MOTION")?;
        self.label("Frames:", "Frames", ":")?;
        let frames = self.whole("a number of frames")?;
        self.keyword("Frame")?;
        self.label("Time:", "Time", ":")?;
        let frame_time = self.frame_time()?;
        let values = self.values(frames)?;
        Ok(Bvh {
            joints: self.joints,
            frame_time,
            channels: self.channels,
            values,
        })
    }

    fn frame_time(&mut self) -> Result<f64> {
        let expected = "a frame time of 0.001 to 1 second";
        let word = self.word(expected)?;
        let seconds: Option<f64> = word.parse().ok();
        // The slack is that of times written with few digits.
        let is_rate = |s: &f64| check_frame_rate(0.9999 / s).is_ok() || check_frame_rate(1.0001 / s).is_ok();
        seconds.filter(is_rate).ok_or_else(|| self.wrong(expected, word))
    }

    /// Every number that is there, so that memory follows the file and not its header.
    fn values(&mut self, frames: usize) -> Result<Vec<f32>> {
        let mut values = Vec::new();
        while let Some(word) = self.tokens.next() {
            values.push(self.parsed(word)?);
        }
        if frames.checked_mul(self.channels) == Some(values.len()) {
            return Ok(values);
        }
        let expected = format!("{frames} frames of {} numbers", self.channels);
        let found = format!("{} numbers", values.len());
        Err(Error::content(self.path, expected, found))
    }

    fn word(&mut self, expected: &str) -> Result<&'a str> {
        let word = self.tokens.next();
        word.ok_or_else(|| Error::content(self.path, expected, "the end of the file"))
    }

    fn keyword(&mut self, keyword: &str) -> Result<()> {
        let word = self.word(keyword)?;
        match word.eq_ignore_ascii_case(keyword) {
            true => Ok(()),
            false => Err(self.wrong(keyword, word)),
        }
    }

    /// A word with its colon, which some programs set apart.
    fn label(&mut self, whole: &str, word: &str, colon: &str) -> Result<()> {
        let found = self.word(whole)?;
        if found.eq_ignore_ascii_case(whole) {
            return Ok(());
        }
        match found.eq_ignore_ascii_case(word) {
            true => self.keyword(colon),
            false => Err(self.wrong(whole, found)),
        }
    }

    fn whole(&mut self, expected: &str) -> Result<usize> {
        let word = self.word(expected)?;
        word.parse().map_err(|_| self.wrong(expected, word))
    }

    fn number(&mut self) -> Result<f32> {
        let word = self.word("a number")?;
        self.parsed(word)
    }

    fn parsed(&self, word: &str) -> Result<f32> {
        let number: Option<f32> = word.parse().ok().filter(|x: &f32| x.is_finite());
        number.ok_or_else(|| self.wrong("a finite number", word))
    }

    fn wrong(&self, expected: &str, found: &str) -> Error {
        let quoted: String = found.chars().take(QUOTED).collect();
        let found = format!("`{}`", quoted.escape_debug());
        Error::content(
            self.path,
            format!("{expected} in line {}", self.tokens.line()),
            found,
        )
    }
}

fn channel(word: &str) -> Option<Channel> {
    let axis = match word.chars().next()?.to_ascii_lowercase() {
        'x' => Axis::X,
        'y' => Axis::Y,
        'z' => Axis::Z,
        _ => return None,
    };
    // The first character is one byte long here.
    match word[1..].to_ascii_lowercase().as_str() {
        "position" | "translation" => Some(Channel::Position(axis)),
        "rotation" => Some(Channel::Rotation(axis)),
        _ => None,
    }
}
