//! Handles: numbers that stand for models and instances.
//!
//! A handle is a pointer in C, for its type, but points to nothing. It is looked up, so that a
//! handle which was released, or never made, is an error and not a stray access. Numbers are not
//! used twice.

use crate::error::Error;
use std::{
    collections::{BTreeMap, btree_map::Entry},
    sync::{
        Arc, PoisonError, RwLock,
        atomic::{AtomicUsize, Ordering},
    },
};

/// Number of the next handle, of either kind: a model's is never an instance's.
static NEXT: AtomicUsize = AtomicUsize::new(1);

/// Objects with handles, and the number of owners of each.
pub(crate) struct Registry<T> {
    kind: &'static str,
    // No code panics while it holds the lock, so that a poisoned lock is taken anyway.
    live: RwLock<BTreeMap<usize, Owned<T>>>,
}

struct Owned<T> {
    object: Arc<T>,
    owners: usize,
}

impl<T> Registry<T> {
    /// Makes a registry without objects, whose `kind` is named in errors.
    pub(crate) const fn new(kind: &'static str) -> Self {
        let live = RwLock::new(BTreeMap::new());
        Self { kind, live }
    }

    /// Adds an object with one owner and returns its handle.
    pub(crate) fn insert<H>(&self, object: Arc<T>) -> *mut H {
        let mut live = self.live.write().unwrap_or_else(PoisonError::into_inner);
        loop {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            // On machines of 32 bits the numbers begin anew some day.
            if let (1.., Entry::Vacant(vacant)) = (number, live.entry(number)) {
                vacant.insert(Owned { object, owners: 1 });
                return std::ptr::without_provenance_mut(number);
            }
        }
    }

    /// Finds the object of a handle. It stays alive while the caller holds it, released or not.
    pub(crate) fn get<H>(&self, handle: *const H) -> Result<Arc<T>, Error> {
        self.check_null(handle)?;
        let live = self.live.read().unwrap_or_else(PoisonError::into_inner);
        let found = live.get(&handle.addr());
        found.map(|o| Arc::clone(&o.object)).ok_or_else(|| self.unknown())
    }

    /// Adds an owner.
    pub(crate) fn retain<H>(&self, handle: *const H) -> Result<(), Error> {
        self.check_null(handle)?;
        let mut live = self.live.write().unwrap_or_else(PoisonError::into_inner);
        let found = live.get_mut(&handle.addr()).ok_or_else(|| self.unknown())?;
        found.owners += 1;
        Ok(())
    }

    /// Takes an owner away; with the last one the handle ends.
    pub(crate) fn release<H>(&self, handle: *const H) -> Result<(), Error> {
        self.check_null(handle)?;
        let mut live = self.live.write().unwrap_or_else(PoisonError::into_inner);
        let found = live.get_mut(&handle.addr()).ok_or_else(|| self.unknown())?;
        found.owners -= 1;
        let ended = match found.owners {
            0 => live.remove(&handle.addr()),
            _ => None,
        };
        // Freeing an instance takes longer than others should wait for the lock.
        drop(live);
        drop(ended);
        Ok(())
    }

    fn check_null<H>(&self, handle: *const H) -> Result<(), Error> {
        match handle.is_null() {
            true => Err(Error::Null { what: self.kind }),
            false => Ok(()),
        }
    }

    fn unknown(&self) -> Error {
        Error::Handle { kind: self.kind }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_handle_ends_with_its_last_owner_and_is_not_used_again() {
        let registry = Registry::new("number");
        let handle: *mut u8 = registry.insert(Arc::new(7));
        registry.retain(handle).unwrap();
        registry.release(handle).unwrap();
        let held = registry.get(handle).unwrap();
        registry.release(handle).unwrap();
        assert!(registry.get(handle).is_err() && registry.retain(handle).is_err());
        assert!(registry.release(handle).is_err());
        assert_eq!(*held, 7);
        let other: *mut u8 = registry.insert(Arc::new(8));
        assert_ne!(other, handle);
    }
}
