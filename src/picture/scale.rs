//! Scales: figures to positions in \[0, 1\], and the ticks that tell them.

use super::tone::log_position;

/// How a figure becomes a position on a colour map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// `min` at 0, `max` at 1.
    Linear {
        /// Lowest figure told apart.
        min: f64,
        /// Highest figure told apart.
        max: f64,
    },
    /// `floor` and everything below at 0, `max` at 1, by the logarithm; 0 < `floor` < `max`.
    Log {
        /// Lowest figure told apart.
        floor: f64,
        /// Highest figure told apart.
        max: f64,
    },
    /// 0 in the middle, -`limit` at 0 and +`limit` at 1; beyond, clipped.
    Symmetric {
        /// Largest magnitude told apart.
        limit: f64,
    },
}

/// A mark on a scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where, in \[0, 1\].
    pub position: f64,
    /// What stands there.
    pub label: String,
}

impl Scale {
    /// Where `value` lies, clipped to \[0, 1\]; NaN stays NaN.
    pub fn position(self, value: f64) -> f64 {
        match self {
            _ if value.is_nan() => value,
            Self::Linear { min, max } => linear(value, min, max),
            Self::Log { floor, max } => log_position(value, floor, max),
            Self::Symmetric { limit } => linear(value, -limit, limit),
        }
    }

    /// The lowest and the highest figure told apart.
    pub fn ends(self) -> (f64, f64) {
        match self {
            Self::Linear { min, max } => (min, max),
            Self::Log { floor, max } => (floor, max),
            Self::Symmetric { limit } => (-limit, limit),
        }
    }

    fn label(self, value: f64) -> String {
        let power = value.log10();
        match self {
            // As a power, where every neighbour is one.
            Self::Log { .. } if power >= 4.0 && power.fract() == 0.0 => format!("1e{power}"),
            _ => figure(value),
        }
    }

    /// Both ends first, then round figures between them, the more important ones first; labels say where a
    /// scale clips.
    pub fn ticks(self) -> Vec<Tick> {
        let (low, high) = self.ends();
        let (below, above) = match self {
            Self::Linear { .. } => ("", ""),
            Self::Log { .. } => ("<=", ">="),
            Self::Symmetric { .. } => ("<=", ">="),
        };
        let mut ticks = vec![
            Tick { position: 0.0, label: format!("{below}{}", self.label(low)) },
            Tick { position: 1.0, label: format!("{above}{}", self.label(high)) },
        ];
        if !(high > low && (high - low).is_finite()) {
            return ticks;
        }
        let mut between = |value: f64| {
            let position = self.position(value);
            if position > 0.0 && position < 1.0 {
                ticks.push(Tick { position, label: self.label(value) });
            }
        };
        match self {
            Self::Log { floor, max } => {
                let powers = floor.log10().floor() as i32..=max.log10().ceil() as i32;
                let count = powers.clone().count();
                powers.clone().step_by(count.div_ceil(8)).for_each(|p| between(10_f64.powi(p)));
                if count <= 4 {
                    powers.for_each(|p| [2.0, 5.0].iter().for_each(|m| between(m * 10_f64.powi(p))));
                }
            }
            _ => {
                let step = round_step((high - low) / 4.0);
                let first = (low / step).ceil();
                between(0.0);
                (0..=8).map(|i| (first + f64::from(i)) * step).filter(|v| *v != 0.0).for_each(between);
            }
        }
        ticks
    }
}

fn linear(value: f64, min: f64, max: f64) -> f64 {
    if max > min { ((value - min) / (max - min)).clamp(0.0, 1.0) } else { 0.5 }
}

/// The smallest of 1, 2, 2.5, 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= step * 0.999)
        .unwrap_or(10.0 * power)
}

/// A figure in few letters: at most four significant digits.
pub(super) fn figure(value: f64) -> String {
    let trim = |s: String| match s.split_once('e') {
        Some((mantissa, power)) if mantissa.contains('.') => {
            format!("{}e{power}", mantissa.trim_end_matches('0').trim_end_matches('.'))
        }
        None if s.contains('.') => s.trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => s,
    };
    match value.abs() {
        0.0 => "0".to_owned(),
        m if !m.is_finite() => value.to_string(),
        m if !(1e-3..1e5).contains(&m) => trim(format!("{value:.2e}")),
        m => trim(format!("{value:.*}", (3 - m.log10().floor() as i32).clamp(0, 6) as usize)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (0.001, "0.001"),
            (12345.0, "12345"),
            (1e5, "1e5"),
            (1.0 / 3.0, "0.3333"),
            (2e-7, "2e-7"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
