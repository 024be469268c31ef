//! Reading numpy arrays and dictionaries from Python's pickles, without executing their calls.
//!
//! A pickle is a program for a stack machine that makes objects by calling Python functions. This
//! reader calls nothing: an object stays a class name, arguments and a state, and numpy's objects
//! are then read by their layout. Opcodes are those of the pickle protocols 2 to 5 (Python's
//! `pickletools`). Memory is proportional to the size of the file.

mod array;
mod machine;

pub(crate) use array::Numbers;
pub(crate) use machine::Pickle;
