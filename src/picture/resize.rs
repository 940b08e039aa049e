//! Making rasters larger (whole factors, nearest neighbour) or smaller (box filter).

/// How many texels become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shrink {
    /// Their mean, weighted by the area that each covers: what a camera further away would see.
    #[default]
    Mean,
    /// The largest one, so that a single outlier stays visible. Of a [`Field`](super::Field): the one of the
    /// largest magnitude, with its sign.
    Max,
}

/// Scales to about `target` columns; see [`Picture::fit_width`](super::Picture::fit_width). `combine` makes
/// one texel of those that it covers, given with the area covered (of a whole texel: 1).
pub(super) fn fit<T: Copy>(
    texels: &[T],
    width: usize,
    height: usize,
    target: usize,
    mut combine: impl FnMut(&mut dyn Iterator<Item = (T, f64)>) -> T,
) -> (usize, usize, Vec<T>) {
    let target = target.max(1);
    if width <= target {
        let factor = target / width;
        return (width * factor, height * factor, enlarge(texels, width, height, factor));
    }
    let rows = ((height as f64 * target as f64 / width as f64).round() as usize).max(1);
    let (across, down) = (spans(width, target), spans(height, rows));
    let mut out = Vec::with_capacity(target * rows);
    for vertical in &down {
        for horizontal in &across {
            out.push(combine(&mut vertical.iter().flat_map(|&(y, wy)| {
                horizontal.iter().map(move |&(x, wx)| (texels[y * width + x], wx * wy))
            })));
        }
    }
    (target, rows, out)
}

/// Every texel as a block of `factor` by `factor`.
pub(super) fn enlarge<T: Copy>(texels: &[T], width: usize, height: usize, factor: usize) -> Vec<T> {
    let (w, h) = (width * factor, height * factor);
    (0..h).flat_map(|y| (0..w).map(move |x| texels[y / factor * width + x / factor])).collect()
}

/// For each of `target` equal parts of `0..source`: the cells it touches, and how much of each.
fn spans(source: usize, target: usize) -> Vec<Vec<(usize, f64)>> {
    // In units of 1 / target cell, so that every edge is a whole number and no sliver arises from rounding.
    (0..target)
        .map(|i| {
            let (from, to) = (i * source, (i + 1) * source);
            (from / target..to.div_ceil(target))
                .map(|cell| {
                    let covered = to.min((cell + 1) * target) - from.max(cell * target);
                    (cell, covered as f64 / target as f64)
                })
                .collect()
        })
        .collect()
}

/// The weighted mean of RGB triples.
pub(super) fn mean3(texels: impl Iterator<Item = ([f64; 3], f64)>) -> [f64; 3] {
    let (sum, weight) = texels.fold(([0.0; 3], 0.0), |(sum, weight), (t, w)| {
        ([sum[0] + t[0] * w, sum[1] + t[1] * w, sum[2] + t[2] * w], weight + w)
    });
    sum.map(|v: f64| v / weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_cover_everything_once() {
        for source in 1..40 {
            for target in 1..=source {
                let mut covered = vec![0.0; source];
                for (cell, weight) in spans(source, target).into_iter().flatten() {
                    assert!(weight > 0.0);
                    covered[cell] += weight;
                }
                assert!(
                    covered.iter().all(|c| (c - 1.0_f64).abs() < 1e-12),
                    "{source} to {target}: {covered:?}"
                );
            }
        }
    }
}
