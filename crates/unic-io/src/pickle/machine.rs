//! The stack machine.

use crate::error::{Error, Result};
use std::{collections::HashMap, ops::Range, path::Path};

/// An object of a pickle; others are named by their index, so that shared ones are stored once.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Node {
    /// `None`, sets, and what else holds no numbers or names.
    Nothing,
    /// Truth values count as 0 and 1.
    Int(i64),
    Text(String),
    /// A range of the file.
    Bytes(Range<usize>),
    /// Lists and tuples.
    List(Vec<usize>),
    Dict(Vec<(usize, usize)>),
    /// `module.name`.
    Global(String),
    /// What a call would have made.
    Object {
        class: usize,
        arguments: usize,
        state: Option<usize>,
    },
}

/// A whole pickle in memory.
pub(crate) struct Pickle<'a> {
    pub(crate) bytes: &'a [u8],
    nodes: Vec<Node>,
    root: usize,
}

impl<'a> Pickle<'a> {
    /// Runs the program as far as its end.
    ///
    /// # Errors
    /// Bytes that are no pickle of the protocols 2 to 5.
    pub(crate) fn read(path: &Path, bytes: &'a [u8]) -> Result<Self> {
        let mut machine = Machine {
            bytes,
            at: 0,
            nodes: Vec::new(),
            stack: Vec::new(),
            marks: Vec::new(),
            memo: HashMap::new(),
        };
        match machine.run() {
            Some(root) => Ok(Self {
                bytes,
                nodes: machine.nodes,
                root,
            }),
            None => Err(Error::content(
                path,
                "a pickle of protocol 2 to 5",
                format!("something else at byte {}", machine.at),
            )),
        }
    }

    /// The object that the pickle is.
    pub(crate) fn root(&self) -> usize {
        self.root
    }

    pub(crate) fn node(&self, index: usize) -> &Node {
        &self.nodes[index]
    }

    /// What a dictionary holds under one of several names.
    pub(crate) fn value(&self, dict: usize, names: &[&str]) -> Option<usize> {
        let Node::Dict(entries) = self.node(dict) else {
            return None;
        };
        let is_named = |key: usize| self.text(key).is_some_and(|text| names.contains(&text));
        entries
            .iter()
            .find(|(key, _)| is_named(*key))
            .map(|(_, value)| *value)
    }

    /// Text, which Python 2 wrote as bytes.
    pub(crate) fn text(&self, index: usize) -> Option<&str> {
        match self.node(index) {
            Node::Text(text) => Some(text),
            Node::Bytes(range) => std::str::from_utf8(&self.bytes[range.clone()]).ok(),
            _ => None,
        }
    }
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    nodes: Vec<Node>,
    stack: Vec<usize>,
    /// Heights of the stack.
    marks: Vec<usize>,
    memo: HashMap<u64, usize>,
}

/// None where bytes, stack or memo end too early or hold what does not belong there.
impl Machine<'_> {
    fn run(&mut self) -> Option<usize> {
        loop {
            match self.byte()? {
                b'.' => return self.pop(),
                0x80 => {
                    self.take(1)?;
                }
                0x95 => {
                    self.take(8)?;
                }
                b'0' => drop(self.pop()?),
                b'1' => drop(self.pop_marked()?),
                b'2' => self.stack.push(*self.stack.last()?),
                b'(' => self.marks.push(self.stack.len()),
                opcode => self.build(opcode)?,
            }
        }
    }

    fn build(&mut self, opcode: u8) -> Option<()> {
        match opcode {
            b'q' | b'r' | 0x94 | b'h' | b'j' => self.remember(opcode),
            b'a' | b'e' | 0x90 | b's' | b'u' | b'b' => self.fill(opcode),
            b']' | b')' | b'}' | 0x8f | b'l' | b't' | b'd' | 0x91 | 0x85..=0x87 => self.collect(opcode),
            b'c' | 0x93 | b'R' | 0x81 | 0x92 => self.make(opcode),
            _ => self.scalar(opcode),
        }
    }

    fn scalar(&mut self, opcode: u8) -> Option<()> {
        let node = match opcode {
            b'N' => Node::Nothing,
            0x88 => Node::Int(1),
            0x89 => Node::Int(0),
            b'J' => Node::Int(i64::from(self.number(4)? as u32 as i32)),
            b'K' => Node::Int(self.number(1)? as i64),
            b'M' => Node::Int(self.number(2)? as i64),
            0x8a => self.long(1)?,
            0x8b => self.long(4)?,
            b'G' => self.skipped(8)?,
            b'X' => self.unicode(4)?,
            0x8c => self.unicode(1)?,
            0x8d => self.unicode(8)?,
            b'U' | b'C' => Node::Bytes(self.counted(1)?),
            b'T' | b'B' => Node::Bytes(self.counted(4)?),
            0x8e | 0x96 => Node::Bytes(self.counted(8)?),
            _ => return None,
        };
        self.push(node)
    }

    /// Memoises the top, or fetches what was memoised.
    fn remember(&mut self, opcode: u8) -> Option<()> {
        let key = match opcode {
            b'q' | b'h' => self.number(1)?,
            b'r' | b'j' => self.number(4)?,
            _ => self.memo.len() as u64,
        };
        if matches!(opcode, b'h' | b'j') {
            self.stack.push(*self.memo.get(&key)?);
        } else {
            self.memo.insert(key, *self.stack.last()?);
        }
        Some(())
    }

    /// Adds to what is on the stack already.
    fn fill(&mut self, opcode: u8) -> Option<()> {
        let items = match opcode {
            b'a' | b'b' => vec![self.pop()?],
            b's' => {
                let value = self.pop()?;
                vec![self.pop()?, value]
            }
            _ => self.pop_marked()?,
        };
        match (self.nodes.get_mut(*self.stack.last()?)?, opcode) {
            (Node::List(list), b'a' | b'e') => list.extend(items),
            (Node::Dict(entries), b's' | b'u') => entries.extend(pairs(&items)?),
            (Node::Object { state, .. }, b'b') => *state = items.first().copied(),
            (Node::Nothing, 0x90) => {}
            _ => return None,
        }
        Some(())
    }

    fn collect(&mut self, opcode: u8) -> Option<()> {
        let node = match opcode {
            b']' | b')' => Node::List(Vec::new()),
            b'}' => Node::Dict(Vec::new()),
            0x8f => Node::Nothing,
            0x91 => self.pop_marked().map(|_| Node::Nothing)?,
            b'd' => Node::Dict(pairs(&self.pop_marked()?)?),
            b'l' | b't' => Node::List(self.pop_marked()?),
            count => {
                let from = self.stack.len().checked_sub(usize::from(count - 0x84))?;
                Node::List(self.stack.split_off(from))
            }
        };
        self.push(node)
    }

    /// Names, and calls that are not made.
    fn make(&mut self, opcode: u8) -> Option<()> {
        let node = match opcode {
            b'c' => {
                let (module, name) = (self.line()?, self.line()?);
                Node::Global(format!("{module}.{name}"))
            }
            0x93 => {
                let (name, module) = (self.pop()?, self.pop()?);
                match (&self.nodes[module], &self.nodes[name]) {
                    (Node::Text(module), Node::Text(name)) => Node::Global(format!("{module}.{name}")),
                    _ => return None,
                }
            }
            _ => {
                if opcode == 0x92 {
                    self.pop()?;
                }
                let (arguments, class, state) = (self.pop()?, self.pop()?, None);
                Node::Object {
                    class,
                    arguments,
                    state,
                }
            }
        };
        self.push(node)
    }

    fn push(&mut self, node: Node) -> Option<()> {
        self.stack.push(self.nodes.len());
        self.nodes.push(node);
        Some(())
    }

    /// Not below a mark that is still open.
    fn pop(&mut self) -> Option<usize> {
        let floor = self.marks.last().copied().unwrap_or(0);
        (self.stack.len() > floor).then(|| self.stack.pop())?
    }

    fn pop_marked(&mut self) -> Option<Vec<usize>> {
        let mark = self.marks.pop()?;
        (mark <= self.stack.len()).then(|| self.stack.split_off(mark))
    }

    fn byte(&mut self) -> Option<u8> {
        Some(self.bytes[self.take(1)?][0])
    }

    fn take(&mut self, count: usize) -> Option<Range<usize>> {
        let range = self.at..self.at.checked_add(count)?;
        self.bytes.get(range.clone())?;
        self.at = range.end;
        Some(range)
    }

    /// A little-endian number of up to eight bytes.
    fn number(&mut self, size: usize) -> Option<u64> {
        let mut wide = [0; 8];
        wide[..size].copy_from_slice(&self.bytes[self.take(size)?]);
        Some(u64::from_le_bytes(wide))
    }

    fn counted(&mut self, size: usize) -> Option<Range<usize>> {
        let count = usize::try_from(self.number(size)?).ok()?;
        self.take(count)
    }

    fn skipped(&mut self, count: usize) -> Option<Node> {
        self.take(count).map(|_| Node::Nothing)
    }

    fn unicode(&mut self, size: usize) -> Option<Node> {
        let range = self.counted(size)?;
        Some(Node::Text(
            String::from_utf8_lossy(&self.bytes[range]).into_owned(),
        ))
    }

    /// Signed, of any length; nothing here counts beyond eight bytes.
    fn long(&mut self, size: usize) -> Option<Node> {
        let range = self.counted(size)?;
        let bytes = &self.bytes[range];
        let sign = bytes
            .last()
            .map_or(0, |last| if last & 0x80 == 0 { 0 } else { 0xff });
        let mut wide = [sign; 8];
        wide.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Node::Int(i64::from_le_bytes(wide)))
    }

    fn line(&mut self) -> Option<String> {
        let length = self.bytes[self.at..].iter().position(|b| *b == b'\n')?;
        let range = self.take(length + 1)?;
        Some(String::from_utf8_lossy(&self.bytes[range.start..range.end - 1]).into_owned())
    }
}

fn pairs(items: &[usize]) -> Option<Vec<(usize, usize)>> {
    let (pairs, rest) = items.as_chunks::<2>();
    rest.is_empty()
        .then(|| pairs.iter().map(|[key, value]| (*key, *value)).collect())
}
