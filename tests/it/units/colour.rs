use warpcheck::picture::{ColourMap, decode_srgb};

/// CIE lightness of a colour, 0 to 100.
fn lightness(colour: [u8; 3]) -> f64 {
    let [r, g, b] = colour.map(|v| f64::from(decode_srgb(f32::from(v) / 255.0)));
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
}

#[test]
fn sequential_maps_rise_in_lightness() {
    for map in [ColourMap::Inferno, ColourMap::Viridis] {
        let steps: Vec<_> = (0..=64).map(|i| lightness(map.colour(f64::from(i) / 64.0))).collect();
        assert!(steps.windows(2).all(|w| w[0] < w[1]), "{map:?} {steps:?}");
        assert!(steps[64] - steps[0] > 70.0);
    }
}

#[test]
fn diverging_map_is_symmetric_about_a_neutral_centre() {
    let at = |t: f64| ColourMap::Diverging.colour(t);
    let mut before = lightness(at(0.5));
    for i in 1..=100 {
        let t = f64::from(i) / 200.0;
        let (low, high) = (lightness(at(0.5 - t)), lightness(at(0.5 + t)));
        assert!((low - high).abs() < 4.5, "{i}: {low} {high}");
        assert!(low < before + 0.3, "{i}: {low} after {before}");
        before = low;
    }
    assert_eq!(at(0.5)[0], at(0.5)[2]);
}

#[test]
fn positions_outside_are_clipped() {
    for map in [ColourMap::Inferno, ColourMap::Viridis, ColourMap::Diverging] {
        assert_eq!(map.colour(-3.0), map.colour(0.0));
        assert_eq!(map.colour(f64::NAN), map.colour(0.0));
        assert_eq!(map.colour(f64::INFINITY), map.colour(1.0));
    }
}
