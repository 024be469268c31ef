//! Stack machine that runs a pickle.

use crate::error::{Error, Result};
use std::{collections::HashMap, ops::Range, path::Path};

/// An object of a pickle. It refers to other objects by their index, so that a shared object is
/// stored once and a circular reference is harmless.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PickleNode {
    /// `None`, sets, floats and every other object that no reader of arrays needs.
    Nothing,
    /// An integer or a truth value (0 or 1).
    Int(i64),
    Text(String),
    /// A byte string, as a range of the file.
    Bytes(Range<usize>),
    /// A list or tuple.
    List(Vec<usize>),
    /// Pairs of key and value.
    Dict(Vec<(usize, usize)>),
    /// A class or function, `module.name`.
    Global(String),
    /// The result of a call that is not executed.
    Object {
        class: usize,
        arguments: usize,
        state: Option<usize>,
    },
}

/// The objects of a pickle.
pub(crate) struct Pickle<'a> {
    pub(crate) bytes: &'a [u8],
    nodes: Vec<PickleNode>,
    root: usize,
}

impl<'a> Pickle<'a> {
    /// Runs the program of a pickle up to its end; `path` is used in errors only.
    ///
    /// # Errors
    /// Bytes that are no pickle of protocol 2 to 5.
    pub(crate) fn read(path: &Path, bytes: &'a [u8]) -> Result<Self> {
        let mut machine = StackMachine {
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

    /// Index of the top object.
    pub(crate) fn root(&self) -> usize {
        self.root
    }

    /// The object of an index.
    pub(crate) fn node(&self, index: usize) -> &PickleNode {
        &self.nodes[index]
    }

    /// Returns the value of a dictionary's first key among `names`.
    pub(crate) fn value(&self, dict: usize, names: &[&str]) -> Option<usize> {
        let PickleNode::Dict(entries) = self.node(dict) else {
            return None;
        };
        let is_named = |key: usize| self.text(key).is_some_and(|text| names.contains(&text));
        entries
            .iter()
            .find(|(key, _)| is_named(*key))
            .map(|(_, value)| *value)
    }

    /// Reads text, which Python 2 writes as bytes.
    pub(crate) fn text(&self, index: usize) -> Option<&str> {
        match self.node(index) {
            PickleNode::Text(text) => Some(text),
            PickleNode::Bytes(range) => std::str::from_utf8(&self.bytes[range.clone()]).ok(),
            _ => None,
        }
    }
}

struct StackMachine<'a> {
    bytes: &'a [u8],
    /// Offset of the next byte.
    at: usize,
    nodes: Vec<PickleNode>,
    /// Indices of objects.
    stack: Vec<usize>,
    /// Heights of the stack at the opcodes MARK that are still open.
    marks: Vec<usize>,
    /// Memoised objects: index by memo key.
    memo: HashMap<u64, usize>,
}

// Every method returns `None` if the bytes, the stack or the memo end too early or hold an object
// of the wrong type: the pickle is damaged.
impl StackMachine<'_> {
    /// Runs opcodes up to STOP and returns the top object.
    fn run(&mut self) -> Option<usize> {
        loop {
            match self.byte()? {
                b'.' => return self.pop(),
                // PROTO: opcodes have the same meaning in all protocols that know them.
                0x80 => {
                    self.take(1)?;
                }
                // FRAME: a length for readers that prefetch.
                0x95 => {
                    self.take(8)?;
                }
                // POP, POP_MARK, DUP and MARK.
                b'0' => drop(self.pop()?),
                b'1' => drop(self.pop_marked()?),
                b'2' => self.stack.push(*self.stack.last()?),
                b'(' => self.marks.push(self.stack.len()),
                opcode => self.build(opcode)?,
            }
        }
    }

    /// Runs an opcode that pushes or changes an object.
    fn build(&mut self, opcode: u8) -> Option<()> {
        match opcode {
            // Memo.
            b'q' | b'r' | 0x94 | b'h' | b'j' => self.remember(opcode),
            // APPEND, APPENDS, ADDITEMS, SETITEM, SETITEMS, BUILD.
            b'a' | b'e' | 0x90 | b's' | b'u' | b'b' => self.fill(opcode),
            // Empty and filled containers.
            b']' | b')' | b'}' | 0x8f | b'l' | b't' | b'd' | 0x91 | 0x85..=0x87 => self.collect(opcode),
            // GLOBAL, STACK_GLOBAL, REDUCE, NEWOBJ, NEWOBJ_EX.
            b'c' | 0x93 | b'R' | 0x81 | 0x92 => self.make(opcode),
            _ => self.scalar(opcode),
        }
    }

    /// Pushes a number, text or bytes.
    fn scalar(&mut self, opcode: u8) -> Option<()> {
        let node = match opcode {
            b'N' => PickleNode::Nothing,
            0x88 => PickleNode::Int(1),
            0x89 => PickleNode::Int(0),
            // BININT is signed; BININT1 and BININT2 are not.
            b'J' => PickleNode::Int(i64::from(self.number(4)? as u32 as i32)),
            b'K' => PickleNode::Int(self.number(1)? as i64),
            b'M' => PickleNode::Int(self.number(2)? as i64),
            0x8a => self.long(1)?,
            0x8b => self.long(4)?,
            // BINFLOAT: no reader of arrays needs a single float.
            b'G' => self.skipped(8)?,
            b'X' => self.unicode(4)?,
            0x8c => self.unicode(1)?,
            0x8d => self.unicode(8)?,
            // Byte strings of Python 2 (`U`, `T`) and of Python 3.
            b'U' | b'C' => PickleNode::Bytes(self.counted(1)?),
            b'T' | b'B' => PickleNode::Bytes(self.counted(4)?),
            0x8e | 0x96 => PickleNode::Bytes(self.counted(8)?),
            _ => return None,
        };
        self.push(node)
    }

    /// Memoises the top of the stack, or pushes a memoised object.
    fn remember(&mut self, opcode: u8) -> Option<()> {
        let key = match opcode {
            b'q' | b'h' => self.number(1)?,
            b'r' | b'j' => self.number(4)?,
            // MEMOIZE counts its keys itself: the size of the memo.
            _ => self.memo.len() as u64,
        };
        if matches!(opcode, b'h' | b'j') {
            self.stack.push(*self.memo.get(&key)?);
        } else {
            self.memo.insert(key, *self.stack.last()?);
        }
        Some(())
    }

    /// Adds items to the list, dictionary or object below them on the stack.
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
            (PickleNode::List(list), b'a' | b'e') => list.extend(items),
            (PickleNode::Dict(entries), b's' | b'u') => entries.extend(pairs(&items)?),
            (PickleNode::Object { state, .. }, b'b') => *state = items.first().copied(),
            // A set, whose items are dropped.
            (PickleNode::Nothing, 0x90) => {}
            _ => return None,
        }
        Some(())
    }

    /// Pushes a list, tuple, dictionary or set.
    fn collect(&mut self, opcode: u8) -> Option<()> {
        let node = match opcode {
            b']' | b')' => PickleNode::List(Vec::new()),
            b'}' => PickleNode::Dict(Vec::new()),
            0x8f => PickleNode::Nothing,
            0x91 => self.pop_marked().map(|_| PickleNode::Nothing)?,
            b'd' => PickleNode::Dict(pairs(&self.pop_marked()?)?),
            b'l' | b't' => PickleNode::List(self.pop_marked()?),
            // TUPLE1 to TUPLE3, 0x85 to 0x87.
            count => {
                let from = self.stack.len().checked_sub(usize::from(count - 0x84))?;
                PickleNode::List(self.stack.split_off(from))
            }
        };
        self.push(node)
    }

    /// Pushes a global name, or the object of a call that is not executed.
    fn make(&mut self, opcode: u8) -> Option<()> {
        let node = match opcode {
            b'c' => {
                // Two lines of text, the only opcode here that is not binary.
                let (module, name) = (self.line()?, self.line()?);
                PickleNode::Global(format!("{module}.{name}"))
            }
            0x93 => {
                let (name, module) = (self.pop()?, self.pop()?);
                match (&self.nodes[module], &self.nodes[name]) {
                    (PickleNode::Text(module), PickleNode::Text(name)) => {
                        PickleNode::Global(format!("{module}.{name}"))
                    }
                    _ => return None,
                }
            }
            _ => {
                // NEWOBJ_EX has keyword arguments on top.
                if opcode == 0x92 {
                    self.pop()?;
                }
                let (arguments, class, state) = (self.pop()?, self.pop()?, None);
                PickleNode::Object {
                    class,
                    arguments,
                    state,
                }
            }
        };
        self.push(node)
    }

    fn push(&mut self, node: PickleNode) -> Option<()> {
        self.stack.push(self.nodes.len());
        self.nodes.push(node);
        Some(())
    }

    /// Pops the top of the stack. Objects below an open mark cannot be popped.
    fn pop(&mut self) -> Option<usize> {
        let floor = self.marks.last().copied().unwrap_or(0);
        (self.stack.len() > floor).then(|| self.stack.pop())?
    }

    /// Pops all objects above the last mark.
    fn pop_marked(&mut self) -> Option<Vec<usize>> {
        let mark = self.marks.pop()?;
        (mark <= self.stack.len()).then(|| self.stack.split_off(mark))
    }

    fn byte(&mut self) -> Option<u8> {
        Some(self.bytes[self.take(1)?][0])
    }

    /// Takes the range of the next `count` bytes.
    fn take(&mut self, count: usize) -> Option<Range<usize>> {
        let range = self.at..self.at.checked_add(count)?;
        self.bytes.get(range.clone())?;
        self.at = range.end;
        Some(range)
    }

    /// Takes a little-endian number of `size` bytes, at most eight.
    fn number(&mut self, size: usize) -> Option<u64> {
        let mut wide = [0; 8];
        wide[..size].copy_from_slice(&self.bytes[self.take(size)?]);
        Some(u64::from_le_bytes(wide))
    }

    /// Takes a length of `size` bytes and the range of that many bytes.
    fn counted(&mut self, size: usize) -> Option<Range<usize>> {
        let count = usize::try_from(self.number(size)?).ok()?;
        self.take(count)
    }

    fn skipped(&mut self, count: usize) -> Option<PickleNode> {
        self.take(count).map(|_| PickleNode::Nothing)
    }

    fn unicode(&mut self, size: usize) -> Option<PickleNode> {
        let range = self.counted(size)?;
        Some(PickleNode::Text(
            String::from_utf8_lossy(&self.bytes[range]).into_owned(),
        ))
    }

    /// Takes a signed integer of any length; `None` above eight bytes, which no array needs.
    fn long(&mut self, size: usize) -> Option<PickleNode> {
        let range = self.counted(size)?;
        let bytes = &self.bytes[range];
        // The sign bit of the last byte is extended over the missing bytes.
        let sign = bytes
            .last()
            .map_or(0, |last| if last & 0x80 == 0 { 0 } else { 0xff });
        let mut wide = [sign; 8];
        wide.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(PickleNode::Int(i64::from_le_bytes(wide)))
    }

    /// Takes the text up to the next line feed.
    fn line(&mut self) -> Option<String> {
        let length = self.bytes[self.at..].iter().position(|b| *b == b'\n')?;
        let range = self.take(length + 1)?;
        Some(String::from_utf8_lossy(&self.bytes[range.start..range.end - 1]).into_owned())
    }
}

/// Groups keys and values; `None` for an odd number of items.
fn pairs(items: &[usize]) -> Option<Vec<(usize, usize)>> {
    let (pairs, rest) = items.as_chunks::<2>();
    rest.is_empty()
        .then(|| pairs.iter().map(|[key, value]| (*key, *value)).collect())
}
