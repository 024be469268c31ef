//! Parser of the BVH grammar.

use super::{Axis, Bvh, BvhJoint, Channel, tokens::Tokens};
use crate::{
    error::{Error, Result},
    frame_rate::check_frame_rate,
};
use glam::Vec3;
use std::{collections::HashSet, fs::File, io::Read, path::Path};

/// Largest number of channels of a joint: three positions and three rotations.
const MAX_CHANNELS: usize = 6;

/// Number of characters of an unexpected word that an error repeats.
const QUOTED_CHARACTERS: usize = 40;

/// Number of bytes read to recognise a file. Byte order mark, blanks and the first word fit.
const START_BYTES: u64 = 64;

impl Bvh {
    /// Reads a BVH file.
    ///
    /// # Errors
    /// The file cannot be read; those of [`parse`](Self::parse).
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path, "read"))?;
        Self::parse(path, &bytes)
    }

    /// Parses the content of a BVH file; `path` is used in errors only. Names may contain bytes
    /// that are not UTF-8.
    ///
    /// # Errors
    /// Unexpected words, unknown channels, braces that do not match, two joints of one name,
    /// numbers that are not finite, a frame rate outside 1 to 1000, another count of numbers than
    /// frames × channels. Each names the line.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let text = String::from_utf8_lossy(bytes);
        let mut parser = BvhParser {
            path,
            tokens: Tokens::new(&text),
            joints: Vec::new(),
            names: HashSet::new(),
            channels: 0,
        };
        parser.hierarchy()?;
        parser.motion()
    }
}

/// Returns whether a file is BVH: by its extension, or by its first word.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn is_bvh(path: &Path) -> Result<bool> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bvh")) {
        return Ok(true);
    }
    let mut start = Vec::new();
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    (file.take(START_BYTES).read_to_end(&mut start)).map_err(Error::io(path, "read"))?;
    Ok(begins_as_bvh(&start))
}

/// Returns whether the first word of a file is `HIERARCHY`.
fn begins_as_bvh(start: &[u8]) -> bool {
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    start.trim_ascii_start().starts_with(b"HIERARCHY")
}

struct BvhParser<'a> {
    path: &'a Path,
    tokens: Tokens<'a>,
    joints: Vec<BvhJoint>,
    names: HashSet<String>,
    /// Number of channels of the joints so far.
    channels: usize,
}

impl<'a> BvhParser<'a> {
    /// Parses the section HIERARCHY.
    fn hierarchy(&mut self) -> Result<()> {
        self.keyword("HIERARCHY")?;
        self.keyword("ROOT")?;
        self.open_joint(None)?;
        // The joints whose braces are open. A stack instead of recursion: a damaged file may nest
        // deeper than the thread's call stack.
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

    /// Parses a joint from its name up to its channels, and returns its index. The caller parses
    /// the closing brace.
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
        if count > MAX_CHANNELS {
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

    /// Parses the section MOTION.
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
        // The tolerance admits 1 and 1000 fps whose frame time is written with few digits.
        let is_rate = |s: &f64| check_frame_rate(0.9999 / s).is_ok() || check_frame_rate(1.0001 / s).is_ok();
        seconds.filter(is_rate).ok_or_else(|| self.wrong(expected, word))
    }

    /// Parses all numbers up to the end of the file and checks their count.
    ///
    /// Memory grows with the numbers that exist; the declared count is not trusted.
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

    /// Parses a word with its colon, which some programs write as a word of its own.
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

    /// Returns an error about a word of the current line.
    fn wrong(&self, expected: &str, found: &str) -> Error {
        // Escaped and cut: a damaged file may have a word of megabytes or control characters.
        let quoted: String = found.chars().take(QUOTED_CHARACTERS).collect();
        let found = format!("`{}`", quoted.escape_debug());
        Error::content(
            self.path,
            format!("{expected} in line {}", self.tokens.line()),
            found,
        )
    }
}

/// Parses the name of a channel, in any case.
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
