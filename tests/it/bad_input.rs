//! Bad files, through the program: one sentence that names the file and the place in it, exit code 2, nothing written.

use assert_cmd::cargo::cargo_bin;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::{TempDir, tempdir};
use warpcheck::picture::{Picture, write_exr};

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data");

/// Runs `warpcheck` with these words in this folder, `--out` a folder that is not there; it has to say one sentence with all the `parts`.
#[track_caller]
fn refuses(folder: &TempDir, words: &str, parts: &[&str]) {
    let out = folder.path().join("new/out");
    let mut command = Command::new(cargo_bin!("warpcheck"));
    command.current_dir(folder.path()).stdin(Stdio::null());
    command.args(words.split_whitespace()).arg("--out").arg(&out);
    let before = listing(folder.path());
    let Output { status, stdout, stderr } = command.output().unwrap();
    let said = String::from_utf8(stderr).unwrap();
    assert_eq!(status.code(), Some(2), "{words}: {said}");
    assert_eq!((said.lines().count(), stdout.len()), (1, 0), "{words}: {said}");
    for part in ["warpcheck: "].iter().chain(parts) {
        assert!(said.contains(part), "{words}: no `{part}` in: {said}");
    }
    assert_eq!(listing(folder.path()), before, "{words} left something behind");
    // A folder that was there stays, and stays empty.
    fs::create_dir_all(&out).unwrap();
    assert_eq!(command.output().unwrap().status.code(), Some(2), "{words}");
    fs::remove_dir(&out).unwrap_or_else(|_| panic!("{words} wrote {:?}", listing(&out)));
    fs::remove_dir(folder.path().join("new")).unwrap();
}

/// Everything under a folder.
fn listing(folder: &Path) -> Vec<String> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        all.push(path.display().to_string());
        if path.is_dir() {
            all.extend(listing(&path));
        }
    }
    all.sort();
    all
}

fn shipped(name: &str) -> Vec<u8> {
    fs::read(format!("{DATA}/{name}")).unwrap()
}

/// The bytes of an OpenEXR file of 6 x 3 grey texels, one of them different.
fn exr(odd: [f32; 3], grey: f32) -> Vec<u8> {
    let folder = tempdir().unwrap();
    let file = folder.path().join("map.exr");
    write_exr(&file, &Picture::from_fn(6, 3, |x, y| if (x, y) == (4, 1) { odd } else { [grey; 3] })).unwrap();
    fs::read(file).unwrap()
}

fn hdr_header(size: &str) -> Vec<u8> {
    format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes()
}

/// Every bad map is refused by every verb that reads maps.
#[test]
fn bad_maps() {
    let cut = |bytes: Vec<u8>, to: usize| bytes[..to].to_vec();
    let hdr = || shipped("env/noon_grass_512.hdr");
    let half = hdr().len() / 2;
    let black_hdr = [hdr_header("-Y 1 +X 2"), vec![0; 8]].concat();
    let huge_exr = {
        let mut bytes = exr([1.0; 3], 1.0);
        // The lower right corner of the data window.
        let at = bytes.windows(11).position(|w| w == b"dataWindow\0").unwrap() + 11 + 6 + 4 + 8;
        bytes[at..at + 8].copy_from_slice(&[0xff, 0xff, 0x0f, 0, 0xff, 0xff, 0x0f, 0]);
        bytes
    };
    let maps: [(&str, Option<Vec<u8>>, &str); 16] = [
        ("gone.hdr", None, "cannot read"),
        ("gone.exr", None, "cannot read"),
        ("empty.hdr", Some(Vec::new()), "empty"),
        ("text.exr", Some(b"not a picture".to_vec()), "not a picture"),
        ("half.hdr", Some(cut(hdr(), half)), "truncated"),
        ("header.hdr", Some(cut(hdr(), 20)), "truncated"),
        ("half.exr", Some(cut(shipped("reference/veach_a3_256x128.exr"), 60_000)), "truncated"),
        ("header.exr", Some(cut(exr([1.0; 3], 1.0), 100)), "truncated"),
        ("negative.exr", Some(exr([1.0, -0.5, 1.0], 1.0)), "column 4, row 1"),
        ("nan.exr", Some(exr([1.0, 1.0, f32::NAN], 1.0)), "column 4, row 1"),
        ("infinite.exr", Some(exr([f32::INFINITY, 1.0, 1.0], 1.0)), "column 4, row 1"),
        ("black.exr", Some(exr([0.0; 3], 0.0)), "black"),
        ("black.hdr", Some(black_hdr), "black"),
        ("huge.hdr", Some(hdr_header("-Y 2000000000 +X 2000000000")), "2000000000"),
        ("none.hdr", Some(hdr_header("-Y 0 +X 5")), "5 x 0"),
        ("huge.exr", Some(huge_exr), "texels"),
    ];
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in ["data/env", "data/mesh"] {
        fs::create_dir_all(path(name)).unwrap();
    }
    let scene = fs::read_to_string(format!("{DATA}/scene/spot_env.toml")).unwrap();
    let scene = scene.replace("../mesh", &format!("{DATA}/mesh"));
    for (name, bytes, what) in maps {
        fs::write(path("scene.toml"), scene.replace("../env/spruit_sunrise_512.hdr", name)).unwrap();
        if let Some(bytes) = &bytes {
            fs::write(path(name), bytes).unwrap();
            fs::write(path("data/env/noon_grass_512.hdr"), bytes).unwrap();
        }
        refuses(&folder, &format!("histogram {name}"), &[name, what]);
        refuses(&folder, "render scene.toml", &[name, what]);
        let verify = "verify environment/noon_grass_512 --data data --json run.json";
        refuses(&folder, verify, &["data/env/noon_grass_512.hdr", what]);
    }
    // What was verified before is no reason to leave half a run behind.
    let verify = "verify hemisphere environment/noon_grass_512 --data data --samples 20k";
    refuses(&folder, verify, &["data/env/noon_grass_512.hdr", "texels"]);
}

const MTL: &str = "newmtl white\nKd .5 .5 .5\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";
const OBJ: &str = "mtllib m.mtl\nusemtl lamp\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const SCENE: &str = "materials = \"mtl\"\n[[mesh]]\nfile = \"m.obj\"\n[camera]\neye = [0.2, 0.2, 3.0]\nat = [0.2, 0.2, 0.0]\n\
    fov_degrees = 40.0\n[picture]\nwidth = 8\nheight = 8\n";

fn write_scene(folder: &TempDir, toml: &str, obj: &str, mtl: &str) {
    for (name, text) in [("s.toml", toml), ("m.obj", obj), ("m.mtl", mtl)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
}

/// Every bad mesh is refused where it is part of a scene and where it is a shipped light.
#[test]
fn bad_meshes() {
    let folder = tempdir().unwrap();
    for name in ["data/env", "data/mesh"] {
        fs::create_dir_all(folder.path().join(name)).unwrap();
    }
    for (old, new, line, what) in [
        ("f 1 2 3", "f 1 2 9", ":6", "vertex 9, but only 3"),
        ("f 1 2 3", "f 1 2 0", ":6", "vertex 0"),
        ("f 1 2 3", "f -1 -2 -4", ":6", "vertex -4"),
        ("f 1 2 3", "f 1 2", ":6", "corners"),
        ("f 1 2 3", "f 1/7 2/7 3/7", ":6", "texture vertex 7"),
        ("f 1 2 3", "", "", "no faces (3 vertices"),
        ("v 1 0 0", "v 1 nan 0", ":4", "NaN"),
        ("v 1 0 0", "v inf 0 0", ":4", "inf"),
        ("v 1 0 0", "v 1 0", ":4", "3 coordinates"),
        ("v 1 0 0", "v 1 0 zero", ":4", "`zero`"),
        ("0 1 0\nf 1 2 3", "0 1", ":5", "3 coordinates"), // the file ends in a vertex
        (OBJ, "", "", "no faces (0 vertices"),
        (OBJ, "\u{1}\u{2}\u{3}", "", ""),
    ] {
        let obj = OBJ.replace(old, new);
        write_scene(&folder, SCENE, &obj, MTL);
        refuses(&folder, "render s.toml", &[&format!("m.obj{line}"), what]);
        fs::write(folder.path().join("data/mesh/spot.obj"), &obj).unwrap();
        fs::write(folder.path().join("data/mesh/m.mtl"), MTL).unwrap();
        refuses(&folder, "verify light/spot --data data", &[&format!("data/mesh/spot.obj{line}"), what]);
        refuses(&folder, "histogram discrete/areas-spot --data data", &["data/mesh/spot.obj", what]);
    }
    // Nothing but area 0: a picture of nothing, no light to draw points on.
    let flat = OBJ.replace("v 0 1 0", "v 2 0 0");
    write_scene(&folder, SCENE, &flat, MTL);
    refuses(&folder, "render s.toml", &["s.toml", "nothing emits light"]);
    fs::write(folder.path().join("data/mesh/spot.obj"), &flat).unwrap();
    refuses(&folder, "verify light/spot --data data", &["data/mesh/spot.obj", "area"]);
    fs::remove_file(folder.path().join("m.obj")).unwrap();
    fs::remove_file(folder.path().join("data/mesh/spot.obj")).unwrap();
    refuses(&folder, "render s.toml", &["cannot read", "m.obj"]);
    refuses(&folder, "verify light/spot --data data", &["cannot read", "data/mesh/spot.obj"]);
}

#[test]
fn bad_materials() {
    let folder = tempdir().unwrap();
    for (old, new, parts) in [
        ("Kd .5 .5 .5", "Kd .5 .5", ["m.mtl:2", "not 2"]),
        ("Kd .5 .5 .5", "Kd .5 nan .5", ["m.mtl:2", "NaN"]),
        ("Kd .5 .5 .5", "Kd .5 -.5 .5", ["m.mtl:2", "white"]),
        ("Kd .5 .5 .5", "Kd .5 .5 .5\nKs .6 0 0", ["white", "K_d + K_s must be at most 1"]),
        ("Kd .5 .5 .5", "Ns -1", ["m.mtl:2", "white"]),
        ("newmtl lamp\nKd 0 0 0\nKe 5 5 5\n", "", ["m.obj:2", "material `lamp` is not defined"]),
        ("Ke 5 5 5", "Ke 5 5 inf", ["m.mtl:5", "inf"]),
        ("Ke 5 5 5", "", ["s.toml", "nothing emits light"]),
    ] {
        write_scene(&folder, SCENE, OBJ, &MTL.replace(old, new));
        refuses(&folder, "render s.toml", &parts);
    }
    fs::remove_file(folder.path().join("m.mtl")).unwrap();
    refuses(&folder, "render s.toml", &["m.obj:1", "cannot read the material library", "m.mtl"]);
}

#[test]
fn bad_scenes() {
    let folder = tempdir().unwrap();
    let line = |key: &str| 1 + SCENE.lines().position(|line| line.starts_with(key)).unwrap();
    for (key, new, what) in [
        ("width", "width = 0", "between 1 and 16384"),
        ("width", "width = -8", "between 1 and 16384"),
        ("width", "width = 1000000", "between 1 and 16384"),
        ("width", "width = 9223372036854775808", ""),
        ("width", "width = 8.5", ""),
        ("fov_degrees", "fov_degrees = 180", "between 0 and 180"),
        ("fov_degrees", "fov_degrees = nan", "finite"),
        ("eye", "eye = [0.0, inf, 3.0]", "finite"),
        ("eye", "eye = [0.0, 3.0]", ""),
        ("materials", "materials = \"pbr\"", "`mtl`"),
        ("height", "heigth = 8", "heigth"),
        ("height", "height = 8\n[environment", ""), // cut off
    ] {
        let old = SCENE.lines().find(|line| line.starts_with(key)).unwrap();
        write_scene(&folder, &SCENE.replace(old, new), OBJ, MTL);
        let line = line(key) + usize::from(new.ends_with("environment"));
        refuses(&folder, "render s.toml", &[&format!("s.toml:{line}"), what]);
    }
    let wide = SCENE.replace("= 8", "= 16384");
    write_scene(&folder, &wide, OBJ, MTL);
    refuses(&folder, "render s.toml", &["s.toml:10", "268435456 pixels, but 67108864 are the most"]);
    for (toml, parts) in [
        ("", ["s.toml:1", "missing"]),
        (&SCENE[..SCENE.find("[camera]").unwrap()], ["s.toml:", "missing field `camera`"]),
        (&SCENE[..SCENE.find("width").unwrap()], ["s.toml:", "missing field `width`"]),
        (&SCENE.replace("eye = [0.2, 0.2, 3.0]", "eye = [0.2, 0.2, 0.0]"), ["s.toml:4", "camera"]),
        (&SCENE.replace("m.obj", "gone.obj"), ["cannot read", "gone.obj"]),
    ] {
        write_scene(&folder, toml, OBJ, MTL);
        refuses(&folder, "render s.toml", &parts);
    }
    refuses(&folder, "render gone.toml", &["cannot read", "gone.toml"]);
    refuses(&folder, "render .", &["cannot read ."]);
    fs::write(folder.path().join("s.toml"), b"materials = \"\xff\"").unwrap();
    refuses(&folder, "render s.toml", &["s.toml"]);
}
