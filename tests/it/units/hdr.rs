use warpcheck::picture::*;

fn file(size: &str, data: &[u8]) -> Vec<u8> {
    [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n", size.as_bytes(), b"\n", data].concat()
}

/// Texels 1, 2, 3, 4 of the file, as red values.
fn reds(size: &str) -> Vec<f32> {
    let data: Vec<u8> = (1..=4).flat_map(|r| [r, 0, 0, 136]).collect();
    decode(&file(size, &data)).unwrap().pixels().iter().map(|t| t[0]).collect()
}

#[test]
fn all_eight_orientations() {
    assert_eq!(reds("-Y 2 +X 2"), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(reds("-Y 2 -X 2"), [2.0, 1.0, 4.0, 3.0]);
    assert_eq!(reds("+Y 2 +X 2"), [3.0, 4.0, 1.0, 2.0]);
    assert_eq!(reds("+Y 2 -X 2"), [4.0, 3.0, 2.0, 1.0]);
    assert_eq!(reds("+X 2 -Y 2"), [1.0, 3.0, 2.0, 4.0]);
    assert_eq!(reds("-X 2 -Y 2"), [3.0, 1.0, 4.0, 2.0]);
    assert_eq!(reds("+X 2 +Y 2"), [2.0, 4.0, 1.0, 3.0]);
    assert_eq!(reds("-X 2 +Y 2"), [4.0, 2.0, 3.0, 1.0]);
}

#[test]
fn old_runs_and_their_chains() {
    let picture = decode(&file("-Y 1 +X 260", &[128, 0, 0, 129, 1, 1, 1, 3, 1, 1, 1, 1])).unwrap();
    assert_eq!(picture.pixels(), [[1.0, 0.0, 0.0]; 260]);
    // The chain on which the image crate multiplies 256 beyond 64 bits.
    let chain = [[9, 9, 9, 128].as_slice(), &[1, 1, 1, 0].repeat(9), &[1, 1, 1, 1]].concat();
    assert!(matches!(decode(&file("-Y 1 +X 3", &chain)), Err(Flaw::Damaged(_))));
    assert!(matches!(decode(&file("-Y 1 +X 2", &[1, 1, 1, 1])), Err(Flaw::Damaged(_))));
}

#[test]
fn exponents_at_both_ends() {
    let picture = decode(&file("-Y 1 +X 3", &[255, 1, 0, 255, 128, 1, 0, 1, 9, 9, 9, 0])).unwrap();
    let two = 2.0_f64;
    assert_eq!(picture.at(0, 0), [(255.0 * two.powi(119)) as f32, two.powi(119) as f32, 0.0]);
    assert_eq!(picture.at(1, 0), [two.powi(-128) as f32, two.powi(-135) as f32, 0.0]);
    assert!(picture.at(1, 0)[1] > 0.0);
    assert_eq!(picture.at(2, 0), [0.0; 3]);
}

#[test]
fn refuses_what_it_cannot_read_faithfully() {
    let flaw = |size, data: &[u8]| decode(&file(size, data)).unwrap_err();
    assert_eq!(flaw("-Y 0 +X 5", &[]), Flaw::Size { width: 5, height: 0 });
    assert!(matches!(flaw("-Y 4294967295 +X 4294967295", &[]), Flaw::Size { .. }));
    assert!(matches!(flaw("-Y 16384 +X 8193", &[]), Flaw::Size { .. }));
    assert!(matches!(flaw("-Y 16384 +X 8192", &[]), Flaw::Truncated(_)));
    for size in ["-Y 4 +Y 4", "-Y -4 +X 4", "4 4", "", "-Y 4 +X 4 4", "-Y 99999999999 +X 4"] {
        assert!(matches!(flaw(size, &[]), Flaw::Damaged(_)), "{size}");
    }
    assert!(matches!(flaw("-Y 1 +X 8", &[2, 2, 0, 9]), Flaw::Damaged(_)));
    assert!(matches!(flaw("-Y 1 +X 8", &[2, 2, 0, 8, 0, 0]), Flaw::Damaged(_)));
    assert!(matches!(flaw("-Y 1 +X 8", &[2, 2, 0, 8, 137, 1]), Flaw::Damaged(_)));
    assert!(matches!(flaw("-Y 1 +X 8", &[2, 2, 0, 8, 136]), Flaw::Truncated(_)));
    let xyz = b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n\0\0\0\0";
    assert!(matches!(decode(xyz), Err(Flaw::Unsupported(_))));
}
