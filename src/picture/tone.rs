//! From linear light to what a screen shows.

use super::{Canvas, Picture};

/// How linear RGB becomes display values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tone {
    /// Times 2^`stops`, clipped to \[0, 1\], then the sRGB curve.
    Srgb {
        /// Exposure in stops; 0 leaves the values alone.
        stops: f32,
    },
    /// Times 2^`stops`, clipped to \[0, 1\], then v^(1/2.2): the curve that many reference images use.
    Gamma {
        /// Exposure in stops; 0 leaves the values alone.
        stops: f32,
    },
    /// Each channel by the logarithm of its value: `floor` and less is black, `ceiling` and more white.
    Log {
        /// The value that is shown black; above zero.
        floor: f32,
        /// The value that is shown white; above `floor`.
        ceiling: f32,
    },
}

impl Default for Tone {
    /// sRGB without exposure.
    fn default() -> Self {
        Self::Srgb { stops: 0.0 }
    }
}

impl Tone {
    /// The display value in \[0, 1\] of one channel. NaN becomes 0.
    pub fn channel(self, linear: f32) -> f32 {
        match self {
            Self::Srgb { stops } => encode_srgb(expose(linear, stops)),
            Self::Gamma { stops } => encode_gamma(expose(linear, stops)),
            Self::Log { floor, ceiling } => {
                log_position(f64::from(linear), f64::from(floor), f64::from(ceiling)) as f32
            }
        }
    }

    /// The whole picture, ready for a screen.
    pub fn show(self, picture: &Picture) -> Canvas {
        let pixels = picture.pixels().iter().map(|texel| texel.map(|v| quantise(self.channel(v)))).collect();
        Canvas::new(picture.width(), picture.height(), pixels).expect("a picture's own shape")
    }
}

/// `linear` times 2^`stops`.
pub fn expose(linear: f32, stops: f32) -> f32 {
    linear * stops.exp2()
}

/// The sRGB curve (IEC 61966-2-1) of a linear value, clipped to \[0, 1\]; NaN becomes 0.
pub fn encode_srgb(linear: f32) -> f32 {
    match clip(linear) {
        v if v <= 0.003_130_8 => 12.92 * v,
        v => 1.055 * v.powf(1.0 / 2.4) - 0.055,
    }
}

/// The linear value of an sRGB value, clipped to \[0, 1\]: undoes [`encode_srgb`].
pub fn decode_srgb(encoded: f32) -> f32 {
    match clip(encoded) {
        v if v <= 0.040_45 => v / 12.92,
        v => ((v + 0.055) / 1.055).powf(2.4),
    }
}

/// v^(1/2.2) of a linear value, clipped to \[0, 1\]; NaN becomes 0.
pub fn encode_gamma(linear: f32) -> f32 {
    clip(linear).powf(1.0 / 2.2)
}

/// Where `value` lies between `floor` (0) and `ceiling` (1) on a logarithmic scale, clipped; whatever is not
/// above the floor, NaN included, is 0.
///
/// ```
/// use warpcheck::picture::log_position;
/// assert_eq!(log_position(10.0, 1.0, 100.0), 0.5);
/// assert_eq!(log_position(0.0, 1.0, 100.0), 0.0);
/// ```
pub fn log_position(value: f64, floor: f64, ceiling: f64) -> f64 {
    if value >= ceiling {
        1.0
    } else if value > floor {
        ((value / floor).ln() / (ceiling / floor).ln()).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// A display value in \[0, 1\] as the nearest byte, clipped; NaN becomes 0.
pub fn quantise(display: f32) -> u8 {
    (clip(display) * 255.0).round() as u8
}

/// Clips to \[0, 1\], and NaN to 0.
fn clip(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}
