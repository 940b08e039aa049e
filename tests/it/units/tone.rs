use warpcheck::picture::*;

#[test]
fn curves_are_monotone_clipped_and_undone() {
    for tone in
        [Tone::Srgb { stops: 1.0 }, Tone::Gamma { stops: -1.0 }, Tone::Log { floor: 1e-3, ceiling: 10.0 }]
    {
        let shown: Vec<_> = (0..4000).map(|i| tone.channel(i as f32 * 0.005)).collect();
        assert!(shown.windows(2).all(|w| w[0] <= w[1]), "{tone:?}");
        assert_eq!((quantise(shown[0]), quantise(shown[3999])), (0, 255), "{tone:?}");
        assert_eq!(tone.channel(f32::NAN), 0.0);
        assert_eq!(quantise(tone.channel(f32::INFINITY)), 255);
        assert_eq!(tone.channel(-1.0), 0.0);
    }
    for byte in 0..=255 {
        assert_eq!(quantise(encode_srgb(decode_srgb(f32::from(byte) / 255.0))), byte);
    }
    // Middle grey, as every table of sRGB has it.
    assert_eq!(quantise(encode_srgb(0.214_041_14)), 128);
}
