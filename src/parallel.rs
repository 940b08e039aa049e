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
