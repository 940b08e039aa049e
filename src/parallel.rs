//! The ways to use several threads, none of which changes a result. Without the feature `parallel` they are loops.

/// `f(0), f(1), …, f(count - 1)`, in this order whatever the number of threads.
#[cfg(feature = "parallel")]
pub(crate) fn map<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    use rayon::prelude::*;
    (0..count).into_par_iter().map(f).collect()
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
#[cfg(feature = "parallel")]
pub(crate) fn chunks_mut<T: Send>(items: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Send + Sync) {
    use rayon::prelude::*;
    items.par_chunks_mut(size).enumerate().for_each(|(i, chunk)| f(i, chunk));
}

/// `f(0, first chunk), f(1, second chunk), …`, each chunk of `size` items but the last.
#[cfg(not(feature = "parallel"))]
pub(crate) fn chunks_mut<T: Send>(items: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Send + Sync) {
    items.chunks_mut(size).enumerate().for_each(|(i, chunk)| f(i, chunk));
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
