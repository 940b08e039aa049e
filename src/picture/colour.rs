//! Colour maps: numbers to colours that every eye reads alike.

use super::tone::{encode_srgb, quantise};

/// From a position in \[0, 1\] to a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColourMap {
    /// Black over red to pale yellow, perceptually uniform (matplotlib): counts.
    Inferno,
    /// Dark violet over green to yellow, perceptually uniform (matplotlib): a second kind of figure beside
    /// counts.
    Viridis,
    /// Blue below, light grey in the middle, orange-red above; both sides equally light at equal distance. Told
    /// apart with any of the common colour-blindnesses: residuals.
    Diverging,
}

impl ColourMap {
    /// The sRGB colour at `position`, clipped to \[0, 1\]; NaN counts as 0.
    ///
    /// ```
    /// use warpcheck::picture::ColourMap;
    /// let [r, g, b] = ColourMap::Diverging.colour(0.5);
    /// assert!(r == g && g == b);
    /// ```
    pub fn colour(self, position: f64) -> [u8; 3] {
        let t = if position.is_nan() { 0.0 } else { position.clamp(0.0, 1.0) };
        match self {
            Self::Inferno => colorous::INFERNO.eval_continuous(t).as_array(),
            Self::Viridis => colorous::VIRIDIS.eval_continuous(t).as_array(),
            Self::Diverging => diverging(2.0 * t - 1.0).map(|v| quantise(encode_srgb(v as f32))),
        }
    }
}

/// Straight lines in Oklab on both sides, mirrored in lightness and chroma, so that only the hue tells the sign. Linear
/// sRGB for -1 to 1.
fn diverging(side: f64) -> [f64; 3] {
    /// Distance from the centre, lightness, chroma.
    const STOPS: [(f64, f64, f64); 3] = [(0.0, 0.955, 0.0), (0.5, 0.72, 0.12), (1.0, 0.42, 0.125)];
    const BLUE: f64 = 255.0;
    const ORANGE: f64 = 42.0;

    let distance = side.abs();
    let [from, to] = if distance < STOPS[1].0 { [STOPS[0], STOPS[1]] } else { [STOPS[1], STOPS[2]] };
    let part = (distance - from.0) / (to.0 - from.0);
    let lightness = from.1 + part * (to.1 - from.1);
    let chroma = from.2 + part * (to.2 - from.2);
    let hue = if side < 0.0 { BLUE } else { ORANGE }.to_radians();
    oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// Linear sRGB of an Oklab colour (Ottosson, "A perceptual color space for image processing", 2020).
fn oklab(lightness: f64, a: f64, b: f64) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diverging_map_stays_within_the_gamut() {
        for i in -100..=100 {
            let linear = diverging(f64::from(i) / 100.0);
            assert!(linear.iter().all(|v| (0.0..=1.0).contains(v)), "{i}: {linear:?}");
        }
    }
}
