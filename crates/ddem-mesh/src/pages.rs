//! Numbers in pages, which copies share until one of them changes a number.

use std::ops::{Index, IndexMut};
use std::sync::Arc;

/// Numbers per page.
const PAGE: usize = 256;

/// List of numbers, shape `(len)`. Copies share its pages; only changed pages are copied.
#[derive(Clone, Debug, Default)]
pub struct Pages {
    pages: Vec<Arc<[u32]>>,
    len: usize,
}

impl Pages {
    /// Length of the list.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if the list has no numbers.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Memory that is not shared with another list `[bytes]`.
    pub(crate) fn bytes(&self, other: Option<&Self>) -> usize {
        let known = |at: usize| other.and_then(|other| other.pages.get(at));
        let own = self.pages.iter().enumerate();
        let own = own.filter(|(at, page)| known(*at).is_none_or(|other| !Arc::ptr_eq(page, other)));
        own.map(|(_, page)| size_of_val(&page[..])).sum::<usize>() + size_of_val(&self.pages[..])
    }
}

impl From<Vec<u32>> for Pages {
    fn from(numbers: Vec<u32>) -> Self {
        Self { pages: numbers.chunks(PAGE).map(Arc::from).collect(), len: numbers.len() }
    }
}

impl Index<usize> for Pages {
    type Output = u32;

    fn index(&self, at: usize) -> &u32 {
        &self.pages[at / PAGE][at % PAGE]
    }
}

impl IndexMut<usize> for Pages {
    fn index_mut(&mut self, at: usize) -> &mut u32 {
        &mut Arc::make_mut(&mut self.pages[at / PAGE])[at % PAGE]
    }
}

#[cfg(test)]
mod tests {
    use super::{PAGE, Pages};

    #[test]
    fn copy_owns_only_changed_pages() {
        let first = Pages::from((0..3 * PAGE as u32 + 5).collect::<Vec<_>>());
        let mut second = first.clone();
        second[PAGE + 7] = 0;
        assert_eq!([first[PAGE + 7], second[PAGE + 7]], [PAGE as u32 + 7, 0]);
        assert!((0..first.len()).all(|at| at == PAGE + 7 || first[at] == second[at]));
        let table = 4 * size_of::<std::sync::Arc<[u32]>>();
        assert_eq!(first.bytes(None), 4 * first.len() + table);
        assert_eq!(second.bytes(Some(&first)), 4 * PAGE + table);
    }
}
