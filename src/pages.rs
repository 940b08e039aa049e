//! Memory for large tables, in huge pages where the system has them: with pages of 4 KiB a table of hundreds of megabytes waits for page
//! tables more than for data. Needs the feature `huge-pages` and Linux (`madvise(2)`, MADV_HUGEPAGE); else it is a boxed slice.

use std::fmt::{self, Debug, Formatter};
use std::ops::{Deref, DerefMut};

/// From so many bytes on: two huge pages.
#[cfg(all(feature = "huge-pages", target_os = "linux"))]
const LARGE: usize = 1 << 22;

/// What tables are made of: numbers for which all bits 0 mean 0.
#[cfg(not(all(feature = "huge-pages", target_os = "linux")))]
pub(crate) trait Plain: Copy + Default + PartialEq + Debug {}
/// What tables are made of: numbers for which all bits 0 mean 0.
#[cfg(all(feature = "huge-pages", target_os = "linux"))]
pub(crate) trait Plain: Copy + Default + PartialEq + Debug + bytemuck::Pod {}
impl Plain for u16 {}
impl Plain for u32 {}
impl Plain for u64 {}
impl Plain for i16 {}
impl Plain for i32 {}
impl Plain for f64 {}

/// A slice of fixed length.
pub(crate) struct Pages<T>(Memory<T>);

enum Memory<T> {
    Heap(Box<[T]>),
    /// Of exactly as many bytes as the slice.
    #[cfg(all(feature = "huge-pages", target_os = "linux"))]
    Mapped(memmap2::MmapMut),
}

impl<T: Plain> Pages<T> {
    /// So many zeros.
    pub(crate) fn zeros(len: usize) -> Self {
        #[cfg(all(feature = "huge-pages", target_os = "linux"))]
        if size_of::<T>() * len >= LARGE
            && let Ok(memory) = memmap2::MmapMut::map_anon(size_of::<T>() * len)
        {
            // Small pages do as well, but slower: no reason to fail.
            let _ = memory.advise(memmap2::Advice::HugePage);
            return Self(Memory::Mapped(memory));
        }
        Self(Memory::Heap(vec![T::default(); len].into()))
    }
}

impl<T: Plain> Deref for Pages<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Memory::Heap(slice) => slice,
            #[cfg(all(feature = "huge-pages", target_os = "linux"))]
            Memory::Mapped(memory) => bytemuck::cast_slice(memory),
        }
    }
}

impl<T: Plain> DerefMut for Pages<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Memory::Heap(slice) => slice,
            #[cfg(all(feature = "huge-pages", target_os = "linux"))]
            Memory::Mapped(memory) => bytemuck::cast_slice_mut(memory),
        }
    }
}

impl<T: Plain> Clone for Pages<T> {
    fn clone(&self) -> Self {
        let mut copy = Self::zeros(self.len());
        copy.copy_from_slice(self);
        copy
    }
}

impl<T: Plain> PartialEq for Pages<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Plain> Debug for Pages<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_are_slices() {
        for len in [0, 1, 1000, (1 << 20) + 3] {
            let mut pages = Pages::<u64>::zeros(len);
            assert!(pages.len() == len && pages.iter().all(|&x| x == 0));
            pages.iter_mut().zip(5..).for_each(|(x, i)| *x = i);
            let copy = pages.clone();
            assert_eq!(copy.iter().copied().sum::<u64>(), (5..5 + len as u64).sum::<u64>());
            assert!(copy == pages);
            if let Some(last) = pages.last_mut() {
                *last = 0;
                assert!(copy != pages);
            }
        }
    }
}
