//! What the fuzz targets under fuzz/ stand for, as tests: inputs that once broke a reader, or would have, and what is promised of
//! readers that get bytes from anywhere.

use std::path::Path;
use std::{fs, io};
use warpcheck::foreign::NpyHeader;
use warpcheck::picture::{Flaw, decode, decode_planes};
use warpcheck::scene::{Error, Material, Mesh, Scene};

fn hdr(size: &str, data: &[u8]) -> Vec<u8> {
    [b"#?RADIANCE\n\n", size.as_bytes(), b"\n", data].concat()
}

/// An OpenEXR file of so many texels with the channel Y, and an empty table of blocks behind its header.
fn exr(width: i32, height: i32) -> Vec<u8> {
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        bytes.extend([name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat());
        bytes.extend((value.len() as i32).to_le_bytes());
        bytes.extend(value);
    };
    let window = [0, 0, width - 1, height - 1].map(i32::to_le_bytes).concat();
    attribute("channels", "chlist", b"Y\0\x02\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\0\0");
    attribute("compression", "compression", &[3]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1.0_f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1.0_f32.to_le_bytes());
    bytes.push(0);
    bytes.extend([0; 64]);
    bytes
}

/// A few bytes that announce gigabytes are refused for their size alone, within the largest size too.
#[test]
fn small_files_that_claim_much_are_refused_at_once() {
    for size in ["-Y 1000000000 +X 1000000000", "+X 4294967295 -Y 4294967295"] {
        assert!(matches!(decode(&hdr(size, &[])), Err(Flaw::Size { .. })), "{size}");
    }
    // 2^27 texels are allowed, in old runs even in 20 bytes: a gigabyte, if one took such a file at its word.
    let runs = [9, 9, 9, 128, 1, 1, 1, 255, 1, 1, 1, 255, 1, 1, 1, 255, 1, 1, 1, 7];
    for size in ["-Y 1 +X 134217728", "-Y 134217728 +X 1", "-Y 16384 +X 8192"] {
        let flaw = decode(&hdr(size, &runs)).unwrap_err();
        assert!(matches!(&flaw, Flaw::Truncated(what) if what.contains("too early for")), "{size}: {flaw}");
    }
    // What is as dense as the densest files is still read.
    let line = [9, 9, 9, 128, 1, 1, 1, 255, 1, 1, 1, 127];
    assert_eq!(decode(&hdr("-Y 2 +X 32768", &[line, line].concat())).unwrap().pixels().len(), 65536);

    assert!(matches!(decode(&exr(1_000_000_000, 1_000_000_000)), Err(Flaw::Size { .. })));
    for (width, height) in [(1 << 27, 1), (1 << 23, 16)] {
        let bytes = exr(width, height);
        let flaw = decode(&bytes).unwrap_err();
        assert!(matches!(&flaw, Flaw::Truncated(what) if what.contains("too early for")), "{flaw}");
        assert_eq!(decode_planes(&bytes).unwrap_err(), flaw);
    }
    // The same header for a size that the file could hold: then it is the block that is wrong.
    assert!(!decode(&exr(8, 8)).unwrap_err().to_string().contains("too early for"));
}

/// One large library under many names would be many times as large in memory.
#[test]
fn a_library_under_many_names_has_its_limit() {
    let half = |_: &Path| Ok(vec![b'#'; 1 << 28]); // of the limit
    let error = Mesh::from_obj(b"mtllib m.mtl\nmtllib d/../m.mtl\n", "m.obj", None, half).unwrap_err();
    assert!(matches!(&error, Error::TooLarge { file, .. } if file.ends_with("m.mtl")), "{error}");
}

/// Looking for a material among many takes no longer than among few; a hundred thousand by a hundred thousand comparisons of names were minutes.
#[test]
fn many_materials_are_no_hang() {
    let mtl: String = (0..100_000).map(|i| format!("newmtl a-material-with-a-long-name-{i}\n")).collect();
    let uses: String = (0..100_000).map(|_| "usemtl a-material-with-a-long-name-99999\n").collect();
    let obj = format!("mtllib m.mtl\n{uses}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let mesh = Mesh::from_obj(obj.as_bytes(), "m.obj", None, |_| Ok(mtl.clone().into_bytes())).unwrap();
    assert_eq!((mesh.materials.len(), mesh.material_of_triangle[0]), (100_000, 99_999));
}

#[test]
fn memory_reads_as_the_disk_does() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scene");
    for name in ["cornell.toml", "spot_env.toml", "veach_a3.toml"] {
        let path = folder.join(name);
        let text = fs::read_to_string(&path).unwrap();
        let mut asked = Vec::new();
        let memory = Scene::from_toml_with(&text, &path, |file| {
            asked.push(file.to_owned());
            fs::read(file)
        })
        .unwrap();
        let disk = Scene::load(&path).unwrap();
        assert_eq!((&memory.triangles, &memory.materials), (&disk.triangles, &disk.materials));
        assert!(asked.iter().any(|file| file.extension().is_some_and(|e| e == "obj")), "{asked:?}");
    }
    let mtl = folder.join("cornell_measured.mtl");
    let materials = Material::from_mtl(&fs::read(mtl).unwrap(), "c.mtl").unwrap();
    assert_eq!(materials, Mesh::read(folder.join("cornell_measured.obj")).unwrap().materials);
    let error = Material::from_mtl(b"newmtl a\nKd 1 2", "c.mtl").unwrap_err();
    assert!(error.to_string().starts_with("c.mtl:2: "), "{error}");
    let gone = |_: &Path| Err(io::Error::from(io::ErrorKind::NotFound));
    let error = Mesh::from_obj(b"\nmtllib m.mtl", "a/m.obj", None, gone).unwrap_err();
    assert!(error.to_string().starts_with("a/m.obj:2: cannot read the material library a/m.mtl"), "{error}");
}

/// A pipe or a terminal as a mesh, or as the library of one, would be waited for without end.
#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_waited_for() {
    for refused in [Mesh::read("/dev/zero").map(|_| ()), Scene::load("/dev/zero").map(|_| ())] {
        let error = refused.unwrap_err().to_string();
        assert_eq!(error, "cannot read /dev/zero: not a regular file");
    }
}

/// What a message quotes from a file doesn't break its line, isn't obeyed by a terminal, and isn't a megabyte.
#[test]
fn quoted_input_stays_in_a_line() {
    let message = |header: &str| {
        let mut bytes = b"\x93NUMPY\x02\0".to_vec();
        bytes.extend((header.len() as u32).to_le_bytes());
        bytes.extend(header.as_bytes());
        NpyHeader::read("a.npy", &mut &bytes[..]).unwrap_err().to_string()
    };
    let long = format!("{{'descr': '{}'}}", "f".repeat(100_000));
    let axes = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({})}}", "1,".repeat(9000));
    let odd = "{'\u{1b}[31mdescr\r\n': '<f8'}";
    for header in [&long, &axes, odd] {
        let message = message(header);
        assert!(!message.contains(char::is_control) && message.len() < 1000, "{message}");
    }
    assert!(message(odd).contains(r"`\u{1b}[31mdescr\r\n`"), "{}", message(odd));
    assert!(message(&axes).contains("more than 64 axes"), "{}", message(&axes));
}
