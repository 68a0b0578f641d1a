//! Values that count their changes, so that data derived from them are known to be out of date.

use std::ops::{Deref, DerefMut};

/// Value and the number of times that it was borrowed for changes.
#[derive(Clone, Debug)]
pub struct Tracked<T> {
    value: T,
    revision: u64,
}

impl<T> Tracked<T> {
    /// Value without changes so far.
    pub fn new(value: T) -> Self {
        Self { value, revision: 0 }
    }

    /// Number of changes so far.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Value for a change on which no derived data depend; it is not counted.
    pub fn uncounted(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T> Deref for Tracked<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Tracked<T> {
    fn deref_mut(&mut self) -> &mut T {
        self.revision += 1;
        &mut self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_changes_are_counted() {
        let mut numbers = Tracked::new(vec![1, 2]);
        assert_eq!((numbers.len(), numbers.revision()), (2, 0));
        numbers.push(3);
        assert_eq!((numbers.len(), numbers.revision()), (3, 1));
        numbers.uncounted().reserve(7);
        assert_eq!(numbers.revision(), 1);
    }
}
