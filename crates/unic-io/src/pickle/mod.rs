//! Numpy arrays and dictionaries from Python's pickles, without running what they ask for.
//!
//! A pickle is a program for a stack machine whose objects are made by calling Python functions. Nothing is
//! called here: objects stay a name, arguments and a state, and numpy's are then read by their layout. Opcodes
//! are those of the pickle protocols 2 to 5 (Python's `pickletools`); memory is of the order of the file.

mod array;
mod machine;

pub(crate) use array::Numbers;
pub(crate) use machine::Pickle;
