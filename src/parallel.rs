//! The ways to use several threads, none of which changes a result. Without the feature `parallel` they are loops.

use std::sync::Mutex;

/// Pieces a thread, so that no thread is left with a long one.
#[cfg(feature = "parallel")]
const PIECES: usize = 16;

/// `f(0)`, `f(1)`, …, `f(count - 1)`, in any order. The one loop that rayon is asked for, so that what it is made of is compiled once and not once a caller.
#[cfg(feature = "parallel")]
fn each(count: usize, f: &(dyn Fn(usize) + Sync)) {
    use rayon::prelude::*;
    (0..count).into_par_iter().for_each(f);
}

/// `f(0)`, `f(1)`, …, `f(count - 1)`.
#[cfg(not(feature = "parallel"))]
fn each(count: usize, f: &(dyn Fn(usize) + Sync)) {
    (0..count).for_each(f);
}

/// `f(0), f(1), …, f(count - 1)`, in this order whatever the number of threads.
#[cfg(feature = "parallel")]
pub(crate) fn map<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    let size = count.div_ceil(PIECES * rayon::current_num_threads()).max(1);
    let pieces: Vec<Mutex<Vec<T>>> = (0..count.div_ceil(size)).map(|_| Mutex::default()).collect();
    each(pieces.len(), &|piece| {
        let made = (piece * size..count.min((piece + 1) * size)).map(&f).collect();
        *pieces[piece].lock().expect("one thread a piece") = made;
    });
    // Where a thread has panicked, the panic goes on by itself.
    let inner = |piece: Mutex<Vec<T>>| piece.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    pieces.into_iter().flat_map(inner).collect()
}

/// `f(0), f(1), …, f(count - 1)`.
#[cfg(not(feature = "parallel"))]
pub(crate) fn map<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    (0..count).map(f).collect()
}

/// Both results; `a` and `b` may run at the same time.
#[cfg(feature = "parallel")]
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

/// Both results.
#[cfg(not(feature = "parallel"))]
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    (a(), b())
}

/// `f(0, first chunk), f(1, second chunk), …`, each chunk of `size` items but the last.
pub(crate) fn chunks_mut<T: Send>(items: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Send + Sync) {
    let chunks: Vec<_> = items.chunks_mut(size).map(Mutex::new).collect();
    each(chunks.len(), &|i| f(i, &mut chunks[i].lock().expect("one thread a chunk")));
}

/// Adds `0..count` to sums that each start `empty`, and merges those. Only for sums that come out the same in any order: integers.
#[cfg(feature = "parallel")]
pub(crate) fn fold<T: Send>(
    count: usize,
    empty: impl Fn() -> T + Send + Sync,
    add: impl Fn(&mut T, usize) + Send + Sync,
    merge: impl Fn(&mut T, T) + Send + Sync,
) -> T {
    let workers = rayon::current_num_threads().clamp(1, count.max(1));
    // One sum a thread: they can be large.
    let sums = map(workers, |worker| {
        let mut sum = empty();
        (worker..count).step_by(workers).for_each(|i| add(&mut sum, i));
        sum
    });
    let mut total = empty();
    sums.into_iter().for_each(|sum| merge(&mut total, sum));
    total
}

/// Adds `0..count` to a sum.
#[cfg(not(feature = "parallel"))]
pub(crate) fn fold<T: Send>(
    count: usize,
    empty: impl Fn() -> T + Send + Sync,
    add: impl Fn(&mut T, usize) + Send + Sync,
    _merge: impl Fn(&mut T, T) + Send + Sync,
) -> T {
    let mut sum = empty();
    (0..count).for_each(|i| add(&mut sum, i));
    sum
}
