//! Pictures survive the disk, and the disk survives pictures: round trips, damaged input, failed writes.

use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use warpcheck::picture::{
    Canvas, ColourMap, Compression, Error, Field, Flaw, Heat, MAX_TEXELS, Picture, Planes, Scale, Sheet,
    Shrink, TextSize, Tile, Tone, decode, decode_planes, read, read_planes, write_atomically, write_exr,
    write_planes, write_png,
};

fn probe(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/env").join(name)
}

fn reference() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/reference/veach_a3_256x128.exr")
}

/// Values of every kind that a float can be, NaN payloads included.
fn awkward(width: usize, height: usize) -> Picture {
    let bits = |i: usize| f32::from_bits((i as u32).wrapping_mul(2_654_435_761));
    Picture::from_fn(width, height, |x, y| [0, 1, 2].map(|c| bits(3 * (y * width + x) + c)))
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.pixels().as_flattened().iter().map(|v| v.to_bits()).collect()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn exr_round_trip_is_bit_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    for (width, height) in [(1, 1), (7, 1), (1, 33), (64, 48), (130, 17)] {
        let picture = awkward(width, height);
        write_exr(&path, &picture).unwrap();
        let back = read(&path).unwrap();
        assert_eq!((back.width(), back.height()), (width, height));
        assert_eq!(bits(&back), bits(&picture));
        for compression in [Compression::None, Compression::Zip] {
            write_planes(&path, &(&picture).into(), compression).unwrap();
            assert_eq!(bits(&read(&path).unwrap()), bits(&picture));
        }
    }
}

#[test]
fn named_planes_come_back_and_luminance_reads_as_grey() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("planes.exr");
    let long = "a name longer than the thirty-one bytes of the first format";
    let luminance = vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    let planes =
        Planes::new(3, 2, [("variance", vec![1.0; 6]), ("Y", luminance), (long, vec![-1.0; 6])]).unwrap();
    write_planes(&path, &planes, Compression::Zip).unwrap();
    assert_eq!(read_planes(&path).unwrap(), planes);
    assert_eq!(read(&path).unwrap().at(2, 1), [5.0; 3]);

    let depth = Planes::new(1, 1, [("Z", vec![1.0]), ("R", vec![1.0])]).unwrap();
    write_planes(&path, &depth, Compression::None).unwrap();
    let error = read(&path).unwrap_err();
    assert!(matches!(&error, Error::Decode { flaw: Flaw::Channels(found), .. } if found == &["R", "Z"]));
    assert!(error.to_string().contains("planes.exr"), "{error}");
}

#[test]
fn shapes_and_names_are_checked() {
    assert!(matches!(Picture::new(2, 2, vec![[0.0; 3]; 3]), Err(Error::Shape { texels: 3, .. })));
    assert!(matches!(Picture::new(0, 2, vec![]), Err(Error::Shape { .. })));
    assert!(matches!(Canvas::new(usize::MAX, 2, vec![]), Err(Error::Shape { .. })));
    assert!(matches!(Field::new(1, 1, vec![]), Err(Error::Shape { .. })));
    for name in ["", "σ", "a\0", &"x".repeat(256)] {
        assert!(matches!(Planes::new(1, 1, [(name, vec![0.0])]), Err(Error::PlaneName { .. })), "{name:?}");
    }
    assert!(matches!(Planes::new(1, 1, [("a", vec![0.0]), ("a", vec![0.0])]), Err(Error::PlaneName { .. })));
    assert!(matches!(Planes::new(1, 1, [("a", vec![0.0]), ("b", vec![])]), Err(Error::Shape { .. })));
    assert!(matches!(Planes::new(1, 1, Vec::<(String, _)>::new()), Err(Error::Shape { .. })));
}

#[test]
fn png_round_trip_is_exact_and_writing_is_repeatable() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let pixels = (0..768).map(|i| [i as u8, (i / 3) as u8, 255 - i as u8]).collect();
    let canvas = Canvas::new(256, 3, pixels).unwrap();
    write_png(&a, &canvas).unwrap();
    write_png(&b, &canvas).unwrap();
    let bytes = fs::read(&a).unwrap();
    assert_eq!(bytes, fs::read(&b).unwrap());
    let back = image::load_from_memory(&bytes).unwrap().into_rgb8();
    assert_eq!(back.dimensions(), (256, 3));
    assert_eq!(back.as_raw().as_slice(), canvas.pixels().as_flattened());

    let picture = awkward(40, 40);
    write_exr(&a, &picture).unwrap();
    write_exr(&b, &picture).unwrap();
    assert_eq!(fs::read(&a).unwrap(), fs::read(&b).unwrap());
}

#[test]
fn probes_read_as_the_image_crate_reads_them() {
    for name in ["blender_interior_512", "noon_grass_512", "potsdamer_platz_512", "spruit_sunrise_1k"] {
        let bytes = fs::read(probe(&format!("{name}.hdr"))).unwrap();
        let ours = decode(&bytes).unwrap();
        let theirs = image::load_from_memory_with_format(&bytes, image::ImageFormat::Hdr).unwrap();
        let theirs = theirs.into_rgb32f();
        assert_eq!((ours.width() as u32, ours.height() as u32), theirs.dimensions(), "{name}");
        assert!(ours.pixels().as_flattened() == theirs.as_raw().as_slice(), "{name}");
        assert_eq!(ours.first_bad_texel(), None, "{name}");
    }
}

#[test]
fn the_reference_rendering_can_be_read() {
    let picture = read(reference()).unwrap();
    assert_eq!((picture.width(), picture.height()), (256, 128));
    assert_eq!(picture.first_bad_texel(), None);
    let mean = picture.pixels().iter().map(|t| f64::from(t[0])).sum::<f64>() / 32768.0;
    // From the JSON beside it.
    assert!((mean - 0.014_471_113).abs() < 1e-7, "{mean}");
}

#[test]
fn hdr_cut_anywhere_is_an_error() {
    let bytes = fs::read(probe("spruit_sunrise_512.hdr")).unwrap();
    let header = bytes.windows(2).position(|w| w == b"\n\n").unwrap() + 20;
    let cuts =
        (1..20).map(|i| i * bytes.len() / 20).chain(0..header + 40).chain(bytes.len() - 9..bytes.len());
    for cut in cuts {
        match decode(&bytes[..cut]) {
            Err(Flaw::Truncated(_)) => {}
            Err(Flaw::Empty) if cut == 0 => {}
            other => panic!("cut at {cut}: {:?}", other.map(|p| p.width())),
        }
    }
    let message = decode(&bytes[..bytes.len() / 2]).unwrap_err().to_string();
    assert!(message.contains("truncated") && message.contains("scanline"), "{message}");
}

#[test]
fn exr_cut_anywhere_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.exr");
    let picture = Picture::from_fn(64, 40, |x, y| [x as f32, y as f32, (x * y) as f32]);
    for compression in [Compression::None, Compression::Zip] {
        write_planes(&path, &(&picture).into(), compression).unwrap();
        let bytes = fs::read(&path).unwrap();
        for cut in (1..20).map(|i| i * bytes.len() / 20).chain(0..600).chain([bytes.len() - 1]) {
            assert!(decode(&bytes[..cut]).is_err(), "cut at {cut} of {}", bytes.len());
        }
    }
    let bytes = fs::read(reference()).unwrap();
    for cut in (1..20).map(|i| i * bytes.len() / 20) {
        assert!(matches!(decode(&bytes[..cut]), Err(Flaw::Truncated(_))), "cut at {cut}");
    }
}

/// The bytes of a small OpenEXR file, and where the value of the attribute called `name` begins.
fn small_exr(name: &str) -> (Vec<u8>, usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.exr");
    write_exr(&path, &Picture::from_fn(16, 40, |x, y| [x as f32, y as f32, 1.0])).unwrap();
    let bytes = fs::read(path).unwrap();
    // Name, zero, type, zero, size in four bytes, value.
    let key = [name.as_bytes(), b"\0"].concat();
    let kind = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len();
    let value = kind + bytes[kind..].iter().position(|&b| b == 0).unwrap() + 5;
    (bytes, value)
}

#[test]
fn exr_of_absurd_size_is_refused_before_memory_is_claimed() {
    let (mut bytes, at) = small_exr("dataWindow");
    let mut resized = |x: i32, y: i32| {
        bytes[at + 8..at + 12].copy_from_slice(&x.to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&y.to_le_bytes());
        decode(&bytes).unwrap_err()
    };
    for side in [1 << 15, 1 << 20, i32::MAX / 2 - 2] {
        let flaw = resized(side, side);
        assert!(matches!(flaw, Flaw::Size { .. }), "{side}: {flaw}");
        assert!(flaw.to_string().contains(&MAX_TEXELS.to_string()));
    }
    // As large as is allowed: then the file is far too short for its table of blocks.
    assert!(matches!(resized(16383, 8191), Flaw::Truncated(_)));
    assert!(!resized(-1, 39).to_string().is_empty());
}

#[test]
fn unsupported_exr_compression_is_said_as_such() {
    let (mut bytes, at) = small_exr("compression");
    for (method, name) in [(6, "B44"), (7, "B44A"), (8, "DWAA"), (9, "DWAB"), (10, "J2K"), (11, "J2K")] {
        bytes[at] = method;
        let flaw = decode(&bytes).unwrap_err();
        assert!(matches!(&flaw, Flaw::Unsupported(what) if what.contains(name)), "{flaw}");
    }
    bytes[at] = 200;
    assert!(decode(&bytes).is_err());
}

#[test]
fn errors_name_the_file_and_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let say = |name: &str, content: Option<&[u8]>| {
        let path = folder.path().join(name);
        if let Some(content) = content {
            fs::write(&path, content).unwrap();
        }
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
        message
    };
    assert!(say("missing.hdr", None).contains("cannot read"));
    assert!(say("empty.hdr", Some(b"")).contains("empty"));
    assert!(say("text.exr", Some(b"hello")).contains("not a picture"));
    assert!(say("cut.hdr", Some(b"#?RAD")).contains("truncated"));
    assert!(say("zero.hdr", Some(b"#?RADIANCE\n\n-Y 0 +X 8\n")).contains("8 x 0"));
    assert!(read(folder.path()).unwrap_err().to_string().contains("not a regular file"));
    assert!(matches!(read("/dev/zero"), Err(Error::Read { .. })));
}

proptest! {
    #[test]
    fn garbage_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..600), kind in 0..4) {
        let magic: &[u8] = match kind {
            0 => b"",
            1 => b"#?RADIANCE\n\n-Y 9 +X 12\n",
            2 => &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0],
            _ => b"#?RADIANCE\n",
        };
        let bytes = [magic, &bytes].concat();
        let _ = decode(&bytes);
        let _ = decode_planes(&bytes);
    }

    #[test]
    fn damaged_hdr_never_panics(at in 0.0..1.0_f64, value: u8) {
        let mut bytes = fs::read(probe("noon_grass_512.hdr")).unwrap();
        let at = (at.powi(4) * bytes.len() as f64) as usize;
        bytes[at] = value;
        let _ = decode(&bytes);
    }
}

/// Whole files with a few bytes changed: everything must come back as a result. `WARPCHECK_FUZZ=20000` changes
/// each file that often (and has been run).
#[test]
fn damaged_exr_never_panics() {
    let rounds: u64 = std::env::var("WARPCHECK_FUZZ").map_or(100, |n| n.parse().unwrap());
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n as u64) as usize
    };
    for file in packings() {
        for _ in 0..rounds {
            let mut bytes = file.clone();
            let reach = if next(2) == 0 { bytes.len().min(700) } else { bytes.len() };
            for _ in 0..=next(4) {
                let at = next(reach);
                bytes[at] = [0, 255, bytes[at] ^ 1 << next(8), next(256) as u8][next(4)];
            }
            let _ = decode(&bytes);
            let _ = decode_planes(&bytes);
        }
    }
}

/// The same picture in every packing that the exr crate can write, as scanlines and tiles, f16 and f32.
fn packings() -> Vec<Vec<u8>> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Compression::*, Encoding, FlatSamples, Image, LineOrder, Vec2,
        WritableImage, f16,
    };
    let picture = Picture::from_fn(48, 35, |x, y| [x as f32, y as f32, (x * y) as f32 * 0.1]);
    let mut files = Vec::new();
    for compression in [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24] {
        for (blocks, half) in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))]
            .into_iter()
            .flat_map(|blocks| [(blocks, false), (blocks, true)])
        {
            let channel = |(name, c): (&str, usize)| {
                let values = picture.pixels().iter().map(|t| t[c]);
                let samples = if half {
                    FlatSamples::F16(values.map(f16::from_f32).collect())
                } else {
                    FlatSamples::F32(values.collect())
                };
                AnyChannel::new(name, samples)
            };
            let channels = [("B", 2), ("G", 1), ("R", 0)].into_iter().map(channel).collect();
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let size = (picture.width(), picture.height());
            let image = Image::from_encoded_channels(size, encoding, AnyChannels::sort(channels));
            let mut bytes = Cursor::new(Vec::new());
            image.write().non_parallel().to_buffered(&mut bytes).unwrap();
            let bytes = bytes.into_inner();
            let worst = decode(&bytes)
                .unwrap()
                .pixels()
                .as_flattened()
                .iter()
                .zip(picture.pixels().as_flattened())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f32::max);
            assert!(worst < 1.0, "{compression:?} {blocks:?} half {half}: off by {worst}");
            files.push(bytes);
        }
    }
    files
}

#[test]
fn a_failed_write_leaves_everything_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kept.txt");
    write_atomically(&path, |out| out.write_all(b"old")).unwrap();
    let error = write_atomically(&path, |out| {
        out.write_all(&[7; 100_000])?;
        Err(io::Error::other("the pen broke"))
    })
    .unwrap_err();
    assert!(error.to_string().contains("kept.txt") && error.to_string().contains("the pen broke"), "{error}");
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["kept.txt"]);

    let panicking = std::panic::AssertUnwindSafe(|| write_atomically(&path, |_| panic!("in the middle")));
    assert!(std::panic::catch_unwind(panicking).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["kept.txt"]);
}

#[test]
fn an_unwritable_place_is_named_and_left_empty() {
    let folder = tempfile::tempdir().unwrap();
    let canvas = Canvas::filled(2, 2, [0; 3]);
    let file = folder.path().join("file");
    fs::write(&file, "old").unwrap();
    for place in ["no/such/folder/a.png", "file/a.png", "", "."] {
        let path = folder.path().join(place);
        let error = write_png(&path, &canvas).unwrap_err();
        assert!(matches!(error, Error::Write { .. }));
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }

    let mut locked = fs::metadata(&file).unwrap().permissions();
    locked.set_readonly(true);
    fs::set_permissions(&file, locked).unwrap();
    assert!(write_png(&file, &canvas).is_err());
    assert_eq!(fs::read(&file).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["file"]);
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_devices_not_replaced() {
    use std::os::unix::fs::FileTypeExt;

    let folder = tempfile::tempdir().unwrap();
    let (real, link) = (folder.path().join("real"), folder.path().join("link"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    write_atomically(&link, |out| out.write_all(b"new")).unwrap();
    assert_eq!(fs::read(&real).unwrap(), b"new");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

    write_atomically("/dev/null", |out| out.write_all(b"gone")).unwrap();
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

#[test]
fn many_writers_of_one_file_leave_one_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("contested");
    std::thread::scope(|scope| {
        for letter in b'a'..b'i' {
            let path = &path;
            scope.spawn(move || {
                (0..10).for_each(|_| write_atomically(path, |out| out.write_all(&[letter; 9000])).unwrap());
            });
        }
    });
    let content = fs::read(&path).unwrap();
    assert_eq!(content, [content[0]; 9000]);
    assert_eq!(names(folder.path()), ["contested"]);
}

#[test]
fn fitting_keeps_light_or_the_maximum() {
    let mut picture = Picture::from_fn(100, 50, |_, _| [1.0; 3]);
    picture.pixels_mut()[4321] = [9.0, 1.0, 1.0];
    let mean = picture.fit_width(30, Shrink::Mean);
    assert_eq!((mean.width(), mean.height()), (30, 15));
    let total: f32 = mean.pixels().iter().map(|t| t[0]).sum::<f32>() / 450.0;
    assert!((total - 5008.0 / 5000.0).abs() < 1e-5, "{total}");
    let max = picture.fit_width(30, Shrink::Max);
    assert_eq!(max.pixels().iter().map(|t| t[0]).fold(0.0, f32::max), 9.0);
    let large = picture.fit_width(250, Shrink::Mean);
    assert_eq!((large.width(), large.height()), (200, 100));
    assert_eq!(large.at(43, 86), [9.0, 1.0, 1.0]);

    let field = Field::from_fn(8, 2, |x, _| [f64::NAN, -3.0, 2.0, 1.0][x % 4]);
    assert_eq!(field.fit_width(2, Shrink::Max).values(), [-3.0, -3.0]);
    assert_eq!(field.fit_width(2, Shrink::Mean).values(), [0.0, 0.0]);
    let outside = Field::from_fn(4, 1, |_, _| f64::NAN).fit_width(1, Shrink::Mean);
    assert!(outside.values()[0].is_nan() && outside.extent().is_none());
}

#[test]
fn cells_outside_of_the_domain_have_no_colour_of_the_map() {
    let field = Field::new(3, 1, vec![f64::NAN, 0.0, f64::INFINITY]).unwrap();
    for map in [ColourMap::Inferno, ColourMap::Viridis, ColourMap::Diverging] {
        let canvas = Heat { map, scale: Scale::Linear { min: 0.0, max: 1.0 } }.paint(&field);
        assert_eq!(canvas.pixels()[1..], [map.colour(0.0), map.colour(1.0)]);
        assert!((0..=1000).all(|i| map.colour(f64::from(i) / 1000.0) != canvas.pixels()[0]));
    }
}

#[test]
fn odd_sheets_are_drawn_all_the_same() {
    assert!(Sheet::new("").draw().width() > 0);
    let tiny = Sheet::new("A title much longer than the sheet is wide, so that it needs lines")
        .columns(["a", "b", "a header of many words that cannot fit above so narrow a tile"])
        .row("", [])
        .row("label", [Tile::new(Canvas::filled(1, 500, [9; 3])).caption("supercalifragilistic")])
        .tile_width(5)
        .text_size(TextSize::LARGE);
    assert!(tiny.draw().height() > 500);
    let broken = Heat { map: ColourMap::Viridis, scale: Scale::Log { floor: f64::NAN, max: 0.0 } };
    for width in [0, 1, 20, 3000] {
        broken.legend("unit").draw(width, TextSize::SMALL);
    }
}

/// A sheet as reports draw them. `WARPCHECK_DEMO=/tmp/demo.png` keeps it, to be looked at.
#[test]
fn a_sheet_is_the_same_every_time() {
    let counts = Field::from_fn(64, 32, |x, y| {
        let bump = (-((x as f64 - 20.0).powi(2) + (y as f64 - 9.0).powi(2)) / 40.0).exp();
        (1e5 * bump + 3.0 * ((x * 7 + y * 13) % 11) as f64).round()
    });
    let residual = |x: usize, y: usize, bias: f64| {
        let seed =
            (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
        let hash = (seed ^ seed >> 29).wrapping_mul(0x1656_67b1_9e37_79f9);
        let normal =
            [0, 16, 32, 48].map(|s| ((hash >> s) & 0xffff) as f64 / 65536.0).iter().sum::<f64>() - 2.0;
        if x + y < 6 || x + y > 88 { f64::NAN } else { normal * 1.73 + bias * (x as f64 / 32.0 - 1.0) }
    };
    let right = Field::from_fn(64, 32, |x, y| residual(x, y, 0.0));
    let wrong = Field::from_fn(64, 32, |x, y| residual(x, y, 4.0));
    let (counted, judged) = (Heat::counts(&counts), Heat::residuals(5.0));
    let probe = read(probe("spruit_sunrise_512.hdr")).unwrap();
    let shown = |tone: Tone| Tile::new(tone.show(&probe.fit_width(256, Shrink::Mean)));
    let sheet = Sheet::new("Environment map, marginal-conditional")
        .notes(
            "spruit_sunrise_512.hdr, 512 x 256 texels. Columns: φ from 0 to 2π; rows: θ from 0 (top, +Z) to π. \
             65536 samples, seed 7; residuals in standard deviations, clipped at ±5.",
        )
        .columns(["histogram", "residuals, reference", "residuals, sine of theta forgotten"])
        .row(
            "samples and their judgement",
            [
                Tile::new(counted.paint(&counts)).caption("64 x 32 cells").legend(counted.legend("samples a cell")),
                Tile::new(judged.paint(&right)).caption("χ² 2011.4 / 2047, p = 0.71: pass"),
                Tile::new(judged.paint(&wrong)).caption("χ² 9120.8 / 2047, p < 1e-300: fail"),
            ],
        )
        .row(
            "the map itself",
            [
                shown(Tone::default()).caption("sRGB, 0 EV"),
                shown(Tone::Gamma { stops: 2.0 }).caption("gamma 2.2, +2 EV"),
                shown(Tone::Log { floor: 1e-3, ceiling: 1e4 }).caption("log, 1e-3 to 1e4"),
            ],
        )
        .legend(judged.legend("residual, standard deviations"));
    let canvas = sheet.draw();
    assert_eq!(canvas, sheet.draw());
    if let Some(path) = std::env::var_os("WARPCHECK_DEMO") {
        write_png(path, &canvas).unwrap();
    }
}
