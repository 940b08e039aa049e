//! Scenes: what ships loads with the counts that it should have, what is broken is refused with a sentence that says
//! where, and the fast ray queries answer as the obvious ones do.

use glam::Vec3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::{
    f64::consts::PI,
    fs,
    path::{Path, PathBuf},
};
use warpcheck::scene::{
    BruteForce, Bvh, Camera, Convention, Display, Error, FovAxis, Material, Mesh, Ray, RayQueries, Scene,
    TriangleList, UpAxis, View, offset_origin, offset_unit,
};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

fn load(name: &str) -> Scene {
    Scene::load(data("scene").join(name)).unwrap_or_else(|e| panic!("{e}"))
}

const SCENES: [&str; 6] = [
    "veach_a3.toml",
    "cornell.toml",
    "spot_env.toml",
    "veach_marschner.toml",
    "three_spheres.toml",
    "lamps_and_sky.toml",
];

// ---- what ships ----

#[test]
fn veach_a3_is_what_its_numbers_say() {
    let scene = load("veach_a3.toml");
    assert_eq!((scene.triangles.len(), scene.emitters.len()), (3912, 4 * 960));
    assert_eq!(scene.convention, Convention::KdPhong);
    assert_eq!((scene.picture.width, scene.picture.height), (256, 128));
    assert_eq!(scene.picture.display, Display::Gamma22);
    let reference = scene.reference.as_ref().unwrap();
    assert!(reference.file.as_ref().unwrap().exists() && reference.blocks.as_ref().unwrap().exists());
    assert!(reference.radiance.is_empty());
    let lights = [(-4.0, 0.05, Vec3::X), (-2.0, 0.15, Vec3::Y), (1.0, 0.25, Vec3::Z), (4.0, 0.5, Vec3::ONE)];
    for (emitters, (x, r, radiance)) in scene.emitters.chunks(960).zip(lights) {
        let area: f64 = emitters.iter().map(|e| e.area).sum();
        let sphere = 4.0 * PI * r * r;
        assert!(area < sphere && area > 0.98 * sphere, "{area} of {sphere}");
        for e in emitters {
            let middle = (e.vertices[0] + e.vertices[1] + e.vertices[2]) / 3.0 - Vec3::new(x, 5.0, -3.0);
            assert!(e.normal.dot(middle) > 0.0, "the outside emits");
            assert_eq!(e.radiance, radiance);
            assert!(!e.two_sided);
            assert_eq!(scene.material(e.triangle).kd, Vec3::ZERO, "lights don't reflect here");
        }
    }
    let exponents: Vec<f32> = scene.materials.iter().map(|m| m.ns).filter(|&n| n > 1.0).collect();
    assert_eq!(exponents, [10.0, 1e3, 1e4, 1e6]);
}

#[test]
fn veach_a3_is_mirrored_as_the_reference_is() {
    // In the reference's block means, the white light at x = 4 stands in row 0, columns 3 and 4 of 16.
    let scene = load("veach_a3.toml");
    let [x, y] = scene.camera.pixel_of(Vec3::new(4.0, 5.0, -3.0)).unwrap();
    assert!((48.0..80.0).contains(&x) && (0.0..16.0).contains(&y), "{x} {y}");
    let hit = scene.rays().closest(&scene.camera.ray(x, y)).unwrap();
    let towards = scene.camera.eye() - scene.point(&hit);
    assert_eq!(scene.emitted(hit.triangle, towards), Vec3::ONE);
    assert_eq!(scene.emitted(hit.triangle, -towards), Vec3::ZERO, "the back is dark");
}

#[test]
fn the_cornell_box_is_what_was_measured() {
    let scene = load("cornell.toml");
    assert_eq!((scene.triangles.len(), scene.emitters.len()), (36, 2));
    assert_eq!(scene.emissive_area(), 130.0 * 105.0);
    assert_eq!(scene.emitters[0].radiance, Vec3::new(17.0, 12.0, 4.0));
    assert_eq!(scene.emitters[0].normal, Vec3::NEG_Y);
    assert_eq!(scene.material(scene.emitters[0].triangle).kd, Vec3::splat(0.78), "an emitter reflects");
    let names = Mesh::read(data("scene/cornell_measured.obj")).unwrap().names;
    assert_eq!(names, ["floor", "ceiling", "back", "right", "left", "light", "short", "tall"]);
    let side = |x| {
        let hit = scene.rays().closest(&scene.camera.ray(x, 128.0)).unwrap();
        scene.material(hit.triangle).name.as_str()
    };
    assert_eq!((side(15.0), side(241.0)), ("red", "green"));
}

#[test]
fn spot_stands_under_the_sky_alone() {
    let scene = load("spot_env.toml");
    assert_eq!((scene.triangles.len(), scene.emitters.len()), (5856, 0));
    let sky = scene.environment.as_ref().unwrap();
    assert!(sky.file.exists());
    assert_eq!((sky.up, sky.scale), (UpAxis::Y, 1.0));
    let turned = warpcheck::scene::Environment { rotation: 1.0, ..sky.clone() };
    for w in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.6, 0.0, -0.8)] {
        assert!((turned.to_scene(turned.to_map(w)) - w).length() < 1e-6);
        assert_eq!(turned.to_map(Vec3::Y), Vec3::Z);
    }
    let spot = Mesh::read_with(data("mesh/spot.obj"), Some(Material::default())).unwrap();
    assert_eq!((spot.positions.len(), spot.triangles.len()), (2930, 5856)); // V - F/2 = 2: a closed surface
}

#[test]
fn marschners_lights_have_their_areas() {
    let scene = load("veach_marschner.toml");
    assert_eq!((scene.triangles.len(), scene.emitters.len()), (4812, 5 * 960));
    let lights = [(0.5, 800.0), (0.1, 100.0), (0.03333, 901.803), (0.3, 11.1111), (0.9, 1.23457)];
    for (emitters, (r, radiance)) in scene.emitters.chunks(960).zip(lights) {
        let ratio = emitters.iter().map(|e| e.area).sum::<f64>() / (4.0 * PI * r * r);
        assert!(ratio < 1.0 && ratio > 0.98, "{ratio} for radius {r}");
        assert_eq!(emitters[0].radiance, Vec3::splat(radiance));
    }
    // Materials are changed by their name, and only those.
    let roughness: Vec<_> = scene.materials.iter().filter_map(|m| m.roughness).collect();
    assert_eq!(roughness, [0.005, 0.02, 0.05, 0.1]);
    assert!(scene.materials.iter().all(|m| m.name.starts_with("plate") == m.roughness.is_some()));
}

// ---- what is broken ----

/// Writes files, loads the first, and returns the message without the folder, which it must name.
fn refusal(files: &[(&str, &str)]) -> String {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(dir.path().join(name), text).unwrap();
    }
    let path = dir.path().join(files[0].0);
    let outcome = match path.extension().is_some_and(|e| e == "toml") {
        true => Scene::load(&path).map(|_| ()),
        false => Mesh::read(&path).map(|_| ()),
    };
    let message = outcome.expect_err(files[0].1).to_string();
    assert!(!message.contains('\n'), "more than a sentence: {message}");
    let place = format!("{}/", dir.path().display());
    assert!(message.contains(&place), "names no file: {message}");
    message.replace(&place, "")
}

#[track_caller]
fn refuses(files: &[(&str, &str)], expected: &[&str]) {
    let message = refusal(files);
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

const MTL: (&str, &str) = ("m.mtl", "newmtl a\nKd .5 .5 .5\n\nnewmtl lamp\nKd 0 0 0\nKe 1 2 3\n");

/// A triangle's vertices (lines 3 to 5), then line 6, then line 7.
fn obj(extra: &str, face: &str) -> String {
    format!("mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{extra}\n{face}\n")
}

#[test]
fn broken_meshes_are_refused_with_their_line() {
    for (extra, face, expected) in [
        ("v 1 nan 0", "f 1 2 3", ["m.obj:6", "NaN"]),
        ("v 1 inf 0", "f 1 2 3", ["m.obj:6", "inf"]),
        ("v 1e39 0 0", "f 1 2 3", ["m.obj:6", "finite"]),
        ("v 1 2 3 0", "f 1 2 3", ["m.obj:6", "finite"]), // weight 0
        ("v 1 2", "f 1 2 3", ["m.obj:6", "3 coordinates"]),
        ("v 1 2x 3", "f 1 2 3", ["m.obj:6", "`2x`"]),
        ("vn 1 2", "f 1 2 3", ["m.obj:6", "normal"]),
        ("", "f 1 2 4", ["m.obj:7", "vertex 4, but only 3"]),
        ("", "f 1 2 0", ["m.obj:7", "vertex 0"]),
        ("", "f 1 2 -4", ["m.obj:7", "vertex -4"]),
        ("", "f 1 2 -9223372036854775808", ["m.obj:7", "vertex -9223372036854775808"]),
        ("", "f 1 2 99999999999999999999", ["m.obj:7", "no corner"]),
        ("", "f 1/1 2 3", ["m.obj:7", "texture vertex 1, but only 0"]),
        ("", "f 1//1 2 3", ["m.obj:7", "normal 1, but only 0"]),
        ("", "f 1 2", ["m.obj:7", "at least 3 corners"]),
        ("", "f", ["m.obj:7", "at least 3 corners"]),
        ("", "f 1 2 /3", ["m.obj:7", "`/3`"]),
        ("", "f 1 2 3/1/1/1", ["m.obj:7", "texture vertex"]),
        ("", "f 1 2 3///1", ["m.obj:7", "`3///1`"]),
        ("", "f 1 2 three", ["m.obj:7", "`three`"]),
        ("usemtl b", "f 1 2 3", ["m.obj:6", "material `b` is not defined"]),
        ("usemtl", "f 1 2 3", ["m.obj:6", "name of a material"]),
        ("mtllib gone.mtl", "f 1 2 3", ["m.obj:6", "gone.mtl"]),
        ("l 1 2 3", "", ["m.obj has no faces", "3 vertices"]),
    ] {
        refuses(&[("m.obj", &obj(extra, face)), MTL], &expected);
    }
    refuses(&[("m.obj", "")], &["m.obj has no faces"]);
    refuses(&[("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3")], &["m.obj:4", "no material"]);
    let u = "v 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0";
    refuses(&[("m.obj", &obj(u, "f 1 4 5 6 7 8 9 10")), MTL], &["m.obj:13", "polygon of 8 corners"]);
    let error = Mesh::read("/nowhere/at/all.obj").unwrap_err();
    assert!(matches!(error, Error::Io { .. }) && error.to_string().contains("/nowhere/at/all.obj"));
    assert!(matches!(Mesh::read(env!("CARGO_MANIFEST_DIR")), Err(Error::Io { .. })), "a folder");
}

#[test]
fn truncated_files_are_refused() {
    let text = fs::read_to_string(data("scene/cornell_measured.obj")).unwrap();
    let mtl = fs::read_to_string(data("scene/cornell_measured.mtl")).unwrap();
    let cut = text.find("f 1 3 4").unwrap();
    let library = ("cornell_measured.mtl", mtl.as_str());
    refuses(&[("c.obj", &text[..cut + 5]), library], &["c.obj:10", "at least 3 corners"]);
    refuses(&[("c.obj", &text[..cut - 8]), library], &["c.obj has no faces"]);
    refuses(&[("c.obj", &text)], &["c.obj:2", "cornell_measured.mtl"]);
    let cut = mtl.find("Kd 0.14").unwrap();
    refuses(&[("c.obj", &text), (library.0, &mtl[..cut])], &["material `light` is not defined"]);
    refuses(&[("c.obj", &text), (library.0, &mtl[..cut + 9])], &["cornell_measured.mtl:15", "not 2"]);
}

#[test]
fn broken_materials_are_refused_with_their_line() {
    let mesh = obj("", "f 1 2 3");
    for (line, expected) in [
        ("Kd 1 -0.5 1", "Kd of material `a` is -0.5"),
        ("Ke -1 0 0", "Ke of material `a` is -1"),
        ("Ks 0 0 -1", "Ks of material `a` is -1"),
        ("Ns -1", "Ns of material `a` is -1"),
        ("Kd nan 0 0", "NaN"),
        ("Ke inf 0 0", "inf"),
        ("Kd 0.5 0.5", "3 numbers, not 2"),
        ("Kd", "3 numbers, not 0"),
        ("Ns", "1 number, not 0"),
        ("Kd spectral steel.rfl", "`spectral`"),
        ("newmtl", "needs a name"),
    ] {
        let library = format!("newmtl a\n{line}\n");
        refuses(&[("m.obj", &mesh), ("m.mtl", &library)], &["m.mtl:2", expected]);
    }
    refuses(&[("m.obj", &mesh), ("m.mtl", "Kd 1 1 1\n")], &["m.mtl:1", "before the first `newmtl`"]);
    refuses(&[("m.obj", &mesh), ("m.mtl", "newm")], &["m.obj:2", "material `a` is not defined"]);
}

const SCENE: &str = r#"materials = "mtl"
[[mesh]]
file = "m.obj"
two_sided = true
[camera]
eye = [0, 0, 5]
at = [0, 0, 0]
fov_degrees = 40
[picture]
width = 4
height = 4
"#;

#[test]
fn broken_scene_files_are_refused_with_their_line() {
    let lamp = obj("usemtl lamp", "f 1 2 3");
    let mesh = "two_sided = true";
    for (from, to, expected) in [
        ("width = 4", "width = 0", ["s.toml:10", "`picture.width` is 0"]),
        ("width = 4", "width = 16385", ["s.toml:10", "16384"]),
        ("height = 4", "height = -4", ["s.toml:11", "`picture.height` is -4"]),
        ("width = 4\nheight = 4", "width = 16384\nheight = 4097", ["s.toml:11", "67108864"]),
        ("height = 4", "height = 4\nexposure = 0", ["s.toml:12", "`picture.exposure` is 0"]),
        ("eye = [0, 0, 5]", "eye = [0, 0, 0]", ["s.toml:5", "same point"]),
        ("at = [0, 0, 0]", "at = [0, 0, 0]\nup = [0, 0, 2]", ["s.toml:5", "parallel"]),
        ("at = [0, 0, 0]", "at = [0, 0, 0]\nup = [0, 0, 0]", ["s.toml:5", "length 0"]),
        ("eye = [0, 0, 5]", "eye = [0, nan, 5]", ["s.toml:6", "`camera.eye`"]),
        ("eye = [0, 0, 5]", "eye = [0, 1e39, 5]", ["s.toml:6", "`camera.eye`"]),
        ("eye = [0, 0, 5]", "eye = [0, 5]", ["s.toml:6", "length"]),
        ("fov_degrees = 40", "fov_degrees = 180", ["s.toml:8", "`camera.fov_degrees` is 180"]),
        ("fov_degrees = 40", "fov_degrees = inf", ["s.toml:8", "`camera.fov_degrees` is inf"]),
        ("fov_degrees = 40", "fov = 40", ["s.toml:8", "unknown field `fov`"]),
        ("fov_degrees = 40", "fov_degrees = 40\nfov_axis = \"widest\"", ["s.toml:9", "widest"]),
        (mesh, "scale = 0", ["s.toml:4", "`mesh.scale` is 0"]),
        (mesh, "scale = 1e-99", ["s.toml:4", "`mesh.scale`"]),
        (mesh, "scale = 1e30", ["s.toml:3", "farther than 1e15"]),
        (mesh, "rotate_y_degrees = nan", ["s.toml:4", "`mesh.rotate_y_degrees`"]),
        (mesh, "material = { kd = [1, -1, 0] }", ["s.toml:4", "`mesh.material.kd` has a negative"]),
        (mesh, "material = { ns = -1 }", ["s.toml:4", "`mesh.material.ns` is -1"]),
        (mesh, "material = { roughness = 0 }", ["s.toml:4", "`mesh.material.roughness` is 0"]),
        (mesh, "materials.lamb = { ns = 3 }", ["s.toml:4", "names `lamb`, but"]),
        (mesh, "materials.lamp = { ns = -3 }", ["s.toml:4", "`mesh.material.ns` is -3"]),
        (mesh, "materials.lamp = { nz = 3 }", ["s.toml:4", "unknown field `nz`"]),
        (mesh, "material = { roughness = nan }", ["s.toml:4", "`mesh.material.roughness` is NaN"]),
        (mesh, "material = { kd = [1, 0.7, 0], ks = [0, 0.7, 0] }", ["m.obj", "1.4 in channel 1"]),
        (mesh, "material = { ke = [0, 0, 0] }", ["s.toml", "nothing emits light"]),
        ("\"m.obj\"", "\"gone.obj\"", ["gone.obj", "cannot read"]),
        ("\"mtl\"", "\"disney\"", ["s.toml:1", "disney"]),
        ("materials = \"mtl\"", "", ["s.toml:1", "materials"]),
        (
            "[picture]",
            "[environment]\nfile = \"a.hdr\"\nscale = -1\n[picture]",
            ["s.toml:11", "environment.scale"],
        ),
        ("height = 4", "height = 4\n[reference]", ["s.toml:12", "`reference` has nothing to compare with"]),
        (
            "height = 4",
            "height = 4\n[reference]\nradiance.lamb = [1, 1, 1]",
            [
                "s.toml:13",
                "`reference.radiance` names `lamb`, but the materials of the scene are `a`, `lamp`",
            ],
        ),
        (
            "height = 4",
            "height = 4\n[reference]\nradiance = { lamp = [1, 1, -1] }",
            ["s.toml:13", "`reference.radiance` has a negative"],
        ),
        ("[camera]", "[camera", ["s.toml:5", ""]),
        ("[[mesh]]\nfile = \"m.obj\"\ntwo_sided = true\n", "mesh = []\n", ["s.toml:2", "at least one mesh"]),
    ] {
        assert!(SCENE.contains(from));
        refuses(&[("s.toml", &SCENE.replace(from, to)), ("m.obj", &lamp), MTL], &expected);
    }
    // An energy gain counts under the convention in use: K_s is not used in kd-phong.
    let glossy = SCENE.replace(mesh, "material = { kd = [1, 0.7, 0], ks = [0, 0.7, 0] }");
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("m.obj"), &lamp).unwrap();
    fs::write(dir.path().join(MTL.0), MTL.1).unwrap();
    assert!(Scene::from_toml(&glossy.replace("\"mtl\"", "\"kd-phong\""), dir.path().join("s.toml")).is_ok());
    assert!(matches!(Scene::load("/nowhere.toml"), Err(Error::Io { .. })));
}

#[test]
fn a_light_without_an_area_is_no_light() {
    let flat = obj("v 2 0 0\nusemtl lamp", "f 1 2 4");
    refuses(&[("s.toml", SCENE), ("m.obj", &flat), MTL], &["s.toml", "nothing emits light"]);
}

// ---- what is unusual, but right ----

fn read(text: &str) -> Mesh {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("m.obj"), text).unwrap();
    fs::write(dir.path().join(MTL.0), MTL.1).unwrap();
    Mesh::read(dir.path().join("m.obj")).unwrap_or_else(|e| panic!("{e}"))
}

fn area(mesh: &Mesh) -> f32 {
    let corners = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
    mesh.triangles.iter().map(corners).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

#[test]
fn polygons_become_fans_and_other_elements_are_left_out() {
    let quad = read(&obj("v 1 1 0\nl 1 2 3\np 1", "f 1 2 4 3 # a square"));
    assert_eq!((quad.triangles.len(), area(&quad)), (2, 1.0));
    // A dent at (0.2, 0.2), away from the straight line between its neighbours: the area is that of an arrow.
    for face in ["f 1 2 4 3", "f 2 4 3 1", "f 4 3 1 2", "f 3 1 2 4"] {
        let dent = read(&obj("v 0.2 0.2 0", face));
        assert_eq!(dent.triangles.len(), 2);
        assert!((area(&dent) - 0.2).abs() < 1e-6, "{face}: {}", area(&dent));
    }
    let odd = read("\u{feff}mtllib m.mtl\r\n\tusemtl  a\r\nv 0 0 0\nv 1 0 0 1 1 1\nv 0 2 0 2\nf -3 -2 -1\n");
    assert_eq!((odd.triangles.len(), area(&odd)), (1, 0.5));
}

#[test]
fn normals_come_from_the_file_or_from_the_shape() {
    let mut mesh = read(&obj("vn 0 0 2\nvn 0 3 0\nvn 0 0 0", "f 1//1 2//2 3//3"));
    assert_eq!(mesh.normals.as_deref(), Some(&[Vec3::Z, Vec3::Y, Vec3::ZERO][..]));
    mesh.smooth_normals();
    assert_eq!(mesh.normals.as_deref(), Some(&[Vec3::Z; 3][..]));
    assert_eq!(read(&obj("vn 0 0 1", "f 1//1 2 3")).normals, None, "only one corner has one");
    let mut spot = Mesh::read_with(data("mesh/spot.obj"), Some(Material::default())).unwrap();
    assert!(spot.normals.is_none());
    spot.smooth_normals();
    assert!(spot.normals.unwrap().iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
}

#[test]
fn every_face_has_its_own_material() {
    let mesh = read(&obj("f 1 2 3\nusemtl lamp\nf 1 2 3\nf 3 2 1\nusemtl a", "f 1 3 2"));
    assert_eq!(mesh.material_of_triangle, [0, 1, 1, 0]);
    assert_eq!(mesh.materials[1].ke, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!((mesh.materials[0].name.as_str(), mesh.materials[0].ns), ("a", 1.0));
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("m.obj"), obj("", "f 1 2 3")).unwrap();
    fs::write(dir.path().join("m.mtl"), "newmtl a\nKd 0.25\nNs 1e21\nmap_Kd wood.png\nd 0.5\n").unwrap();
    let mesh = Mesh::read(dir.path().join("m.obj")).unwrap();
    assert_eq!((mesh.materials[0].kd, mesh.materials[0].ns), (Vec3::splat(0.25), 1e21));
}

#[test]
fn meshes_are_scaled_then_turned_then_moved() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("m.obj"), obj("usemtl lamp", "f 1 2 3")).unwrap();
    fs::write(dir.path().join(MTL.0), MTL.1).unwrap();
    let moved = "scale = 2\nrotate_y_degrees = 90\ntranslate = [10, 0, 0]\nnormals = \"smooth\"";
    let scene =
        Scene::from_toml(&SCENE.replace("two_sided = true", moved), dir.path().join("s.toml")).unwrap();
    let expected = [Vec3::new(10.0, 0.0, 0.0), Vec3::new(10.0, 0.0, -2.0), Vec3::new(10.0, 2.0, 0.0)];
    let triangle = scene.triangles[0];
    for (v, e) in triangle.vertices.iter().zip(expected) {
        assert!((v - e).length() < 1e-6, "{v} {e}");
    }
    for normal in triangle.shading.unwrap() {
        assert!((normal - triangle.normal).length() < 1e-6 && (normal - Vec3::X).length() < 1e-6);
    }
    assert!((scene.emissive_area() - 2.0).abs() < 1e-6);
}

// ---- the camera ----

#[test]
fn rays_go_where_the_picture_says() {
    let view = View {
        eye: Vec3::new(1.0, 2.0, 3.0),
        at: Vec3::new(1.0, 2.0, 1.0),
        up: Vec3::Y,
        fov: 2.0 * 0.5_f32.atan(),
        fov_axis: FovAxis::Vertical,
        mirror: false,
    };
    let ray = |view, x, y| Camera::new(view, 40, 20).unwrap().ray(x, y);
    let close = |a: Ray, b: Vec3| assert!((a.direction - b.normalize()).length() < 1e-6, "{a:?} {b}");
    assert_eq!(ray(view, 20.0, 10.0), Ray::new(view.eye, Vec3::NEG_Z));
    close(ray(view, 0.0, 0.0), Vec3::new(-1.0, 0.5, -1.0)); // top left
    close(ray(view, 40.0, 0.0), Vec3::new(1.0, 0.5, -1.0));
    close(ray(view, 0.0, 20.0), Vec3::new(-1.0, -0.5, -1.0));
    close(ray(view, 40.0, 20.0), Vec3::new(1.0, -0.5, -1.0));
    let mirrored = View { mirror: true, ..view };
    close(ray(mirrored, 0.0, 0.0), Vec3::new(1.0, 0.5, -1.0));
    close(ray(mirrored, 20.0, 10.0), Vec3::NEG_Z);
    close(ray(View { fov_axis: FovAxis::Horizontal, ..view }, 40.0, 0.0), Vec3::new(0.5, 0.25, -1.0));
    assert_eq!(ray(View { fov_axis: FovAxis::Smaller, ..view }, 3.0, 4.0), ray(view, 3.0, 4.0));
    for view in [view, mirrored] {
        let camera = Camera::new(view, 40, 20).unwrap();
        let [x, y] = camera.pixel_of(camera.ray(7.25, 18.5).at(4.0)).unwrap();
        assert!((x - 7.25).abs() < 1e-4 && (y - 18.5).abs() < 1e-4, "{x} {y}");
        assert_eq!(camera.pixel_of(view.eye + Vec3::Z), None);
    }
    assert!(Camera::new(View { fov: f32::NAN, ..view }, 4, 4).is_err());
    assert!(Camera::new(view, 0, 4).is_err());
}

// ---- rays ----

fn shipped() -> Vec<(&'static str, Vec<[Vec3; 3]>)> {
    let mut all: Vec<_> = SCENES.iter().map(|name| (*name, load(name).vertices())).collect();
    let teapot = Mesh::read_with(data("mesh/teapot.obj"), Some(Material::default())).unwrap();
    let corners = |t: &[u32; 3]| t.map(|i| teapot.positions[i as usize]);
    all.push(("teapot.obj", teapot.triangles.iter().map(corners).collect()));
    all
}

fn bounds(triangles: &[[Vec3; 3]]) -> (Vec3, Vec3) {
    let points = || triangles.iter().flatten().copied();
    (points().reduce(Vec3::min).unwrap(), points().reduce(Vec3::max).unwrap())
}

/// From a box half again as large as the mesh, in a direction of any length, now and then along or almost along an axis.
fn random_ray(rng: &mut ChaCha8Rng, (low, high): (Vec3, Vec3)) -> Ray {
    let mut uniform = || Vec3::new(rng.random(), rng.random(), rng.random());
    let origin = low + (high - low) * (uniform() * 1.5 - 0.25);
    let mut direction = uniform() * 2.0 - 1.0;
    for axis in 0..3 {
        match rng.random_range(0..20) {
            0 => direction[axis] = 0.0,
            1 => direction[axis] = -0.0,
            2 => direction[axis] *= 1e-9,
            _ => {}
        }
    }
    Ray::new(origin, direction * 10.0_f32.powi(rng.random_range(-6..6)))
}

/// Checks that both find the same hit, or two at the same t (a shared edge); true if it is the same one.
#[track_caller]
fn agree(ray: &Ray, fast: &impl RayQueries, brute: &BruteForce) -> bool {
    let (a, b) = (fast.closest(ray), brute.closest(ray));
    let rim = |h: warpcheck::scene::Hit| h.u.min(h.v).min(1.0 - h.u - h.v);
    match (a, b) {
        (Some(a), Some(b)) => {
            assert!((a.t - b.t).abs() <= 1e-5 * b.t, "{ray:?}: {a:?} {b:?}");
            if a.triangle == b.triangle {
                assert!((a.u - b.u).abs() < 1e-4 && (a.v - b.v).abs() < 1e-4, "{ray:?}: {a:?} {b:?}");
            }
        }
        // The oracle rounds, too, and can see a hit on the rim of a surface differently.
        (Some(hit), None) | (None, Some(hit)) => assert!(rim(hit) < 1e-6, "{ray:?}: {a:?} {b:?}"),
        (None, None) => {}
    }
    let t = b.map_or(1.0, |hit| hit.t);
    for end in [0.5 * t, 0.999 * t, 1.001 * t, 2.0 * t] {
        let ray = ray.until(end);
        assert_eq!(fast.occluded(&ray), fast.closest(&ray).is_some(), "{ray:?}");
    }
    a.zip(b).is_some_and(|(a, b)| a.triangle == b.triangle)
}

#[test]
fn fast_rays_agree_with_brute_force() {
    for (name, triangles) in shipped() {
        let (fast, brute) = (Bvh::new(&triangles), BruteForce::new(&triangles));
        let mut rng = ChaCha8Rng::seed_from_u64(20);
        let (rays, bounds) = (1000, bounds(&triangles));
        let same = (0..rays).filter(|_| agree(&random_ray(&mut rng, bounds), &fast, &brute)).count();
        println!("{name}: {same} of {rays} rays hit");
        assert!(same > rays / 40, "{name}: {same}");
        if triangles.len() < 2000 {
            let list = TriangleList::new(&triangles);
            let mut rng = ChaCha8Rng::seed_from_u64(20);
            assert_eq!(
                (0..rays).filter(|_| agree(&random_ray(&mut rng, bounds), &list, &brute)).count(),
                same
            );
        }
    }
}

#[test]
fn rays_that_leave_surfaces_agree_and_shadow_rays_arrive() {
    for (name, triangles) in shipped() {
        let (fast, brute) = (Bvh::new(&triangles), BruteForce::new(&triangles));
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let (low, high) = bounds(&triangles);
        let unit = offset_unit(low.abs().max(high.abs()).max_element());
        for _ in 0..500 {
            let from = rng.random_range(0..triangles.len());
            let [a, b, c] = triangles[from].map(|p| p.as_dvec3());
            let (mut u, mut v): (f64, f64) = (rng.random(), rng.random());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            let point = (a + (b - a) * u + (c - a) * v).as_vec3();
            let direction = random_ray(&mut rng, (low, high)).direction.normalize();
            let side = if normal.dot(direction) < 0.0 { -normal } else { normal };
            let ray =
                Ray { from: Some(from as u32), ..Ray::new(offset_origin(point, side, unit), direction) };
            agree(&ray, &fast, &brute);
            let Some(hit) = fast.closest(&ray) else { continue };
            assert_ne!(hit.triangle, from as u32, "{name}");
            let there = triangles[hit.triangle as usize];
            let target = there[0] + (there[1] - there[0]) * hit.u + (there[2] - there[0]) * hit.v;
            if (target - ray.origin).length() > 1e-3 * unit {
                assert!(fast.reaches(ray.origin, ray.from, target, hit.triangle), "{name}: {ray:?} {hit:?}");
                let beyond = target + direction * 0.01 * unit;
                assert!(!fast.reaches(ray.origin, ray.from, beyond, u32::MAX), "{name}: {ray:?} {hit:?}");
            }
        }
    }
}

#[test]
fn a_closed_mesh_has_no_holes() {
    // Aimed from inside at corners and edges, where a test that is not watertight leaks. What is hit may lie farther
    // away than the target, where the surface bends away from the ray.
    let triangles = load("spot_env.toml").vertices();
    let rays = Bvh::new(&triangles);
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    for t in &triangles {
        for i in 0..3 {
            for s in [0.0, 0.5, rng.random::<f32>()] {
                let ray = Ray::new(Vec3::ZERO, t[i].lerp(t[(i + 1) % 3], s));
                assert!(rays.closest(&ray).is_some(), "{ray:?}");
            }
        }
    }
}

#[test]
fn what_the_camera_sees_sees_the_camera() {
    for name in SCENES {
        let scene = load(name);
        let mut rng = ChaCha8Rng::seed_from_u64(23);
        let (w, h) = (scene.picture.width as f32, scene.picture.height as f32);
        for _ in 0..4000 {
            let ray = scene.camera.ray(rng.random::<f32>() * w, rng.random::<f32>() * h);
            let Some(hit) = scene.rays().closest(&ray) else { continue };
            let point = scene.point(&hit);
            assert!((point - ray.at(hit.t)).length() < 1e-6 * point.length().max(hit.t), "{name}: {hit:?}");
            let back = scene.leave(&hit, scene.camera.eye() - point).until(1.0);
            assert!(!scene.rays().occluded(&back), "{name}: {hit:?}");
        }
    }
}

#[test]
fn offsets_follow_the_scale() {
    for scale in [-40, 0, 11, 30].map(|e| 2.0_f32.powi(e)) {
        let unit = offset_unit(20.0 * scale);
        assert_eq!(unit, scale);
        let p = Vec3::new(3.0, -7.0, 1e-4);
        let n = Vec3::new(0.6, -0.64, 0.48);
        let moved = (offset_origin(p * scale, n, unit) - p * scale) / scale;
        assert_eq!(moved, offset_origin(p, n, 1.0) - p, "the same at any scale");
        assert!((moved * n).min_element() > 0.0 && moved.length() < 2e-4, "{moved}");
    }
    assert_eq!(offset_unit(0.0), 1.0);
}

#[test]
fn extreme_triangles_build_and_answer() {
    let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let down = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    assert_eq!(Bvh::new(&[]).closest(&down), None);
    assert_eq!(Bvh::new(&[triangle; 500]).closest(&down).unwrap().t, 1.0);
    assert_eq!(Bvh::new(&[[Vec3::ONE; 3]; 50]).closest(&down), None, "no area");
    for scale in [1e-15_f32, 1e-6, 1e15] {
        let rays = Bvh::new(&[triangle.map(|p| p * scale)]);
        let ray = Ray::new(Vec3::new(0.2, 0.2, 1e-4) * scale, Vec3::NEG_Z);
        assert!((rays.closest(&ray).unwrap().t / (1e-4 * scale) - 1.0).abs() < 1e-6, "scale {scale}");
    }
    // Sizes over a hundred powers of two: a tree as deep as f32 allows.
    let nested: Vec<_> =
        (0..4000).map(|i| triangle.map(|p| (p + Vec3::Z) * (i as f32 / 40.0 - 50.0).exp2())).collect();
    let (fast, brute) = (Bvh::new(&nested), BruteForce::new(&nested));
    for x in (-30..30).map(|i| 2.0_f32.powi(i)) {
        let ray = Ray::new(Vec3::new(0.3 * x, 0.2 * x, 0.0), Vec3::Z);
        assert_eq!(fast.closest(&ray).map(|h| h.t), brute.closest(&ray).map(|h| h.t), "{x}");
    }
    let rays = Bvh::new(&[triangle]);
    for bad in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(rays.closest(&Ray::new(down.origin, bad)), None);
    }
    assert_eq!(rays.closest(&Ray::new(Vec3::NAN, Vec3::NEG_Z)), None);
    assert!(!rays.reaches(Vec3::ZERO, None, Vec3::ZERO, 0), "a target at the origin is not reached");
    assert!(rays.closest(&down.until(1.0)).is_some(), "the end belongs to the ray");
    assert!(rays.closest(&down.until(0.999)).is_none());
}

// ---- garbage ----

fn garbage_line() -> impl Strategy<Value = String> {
    const WORDS: [&str; 16] = [
        "v",
        "vn",
        "vt",
        "f",
        "usemtl",
        "usemtl a",
        "mtllib m.mtl",
        "newmtl",
        "Kd",
        "Ns",
        "o",
        "l",
        "#",
        "nan",
        "1e40",
        "1//1",
    ];
    let word = prop_oneof![
        prop::sample::select(&WORDS[..]).prop_map(String::from),
        (-6_i32..6).prop_map(|i| i.to_string()),
        any::<f32>().prop_map(|x| x.to_string()),
        "\\PC{0,8}",
    ];
    prop::collection::vec(word, 0..8).prop_map(|words| words.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, rng_seed: RngSeed::Fixed(4), ..Default::default() })]

    #[test]
    fn garbage_meshes_are_read_or_refused(
        head in any::<bool>(),
        lines in prop::collection::vec(garbage_line(), 0..12),
        library in prop::collection::vec(garbage_line(), 0..3),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let mut text = if head { obj("v 1 1 1\nvn 0 0 1", "f 1 2 3") } else { String::new() };
        text.push_str(&lines.join("\n"));
        fs::write(dir.path().join("m.obj"), &text).unwrap();
        fs::write(dir.path().join("m.mtl"), format!("newmtl a\n{}", library.join("\n"))).unwrap();
        match Mesh::read_with(dir.path().join("m.obj"), Some(Material::default())) {
            Ok(mesh) => {
                prop_assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
                prop_assert!(mesh.material_of_triangle.iter().all(|&i| (i as usize) < mesh.materials.len()));
                prop_assert_eq!(mesh.material_of_triangle.len(), mesh.triangles.len());
                prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
            }
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }

    #[test]
    fn garbage_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("m.obj"), &bytes).unwrap();
        prop_assert!(Mesh::read(dir.path().join("m.obj")).is_err());
        prop_assert!(Scene::from_toml(&String::from_utf8_lossy(&bytes), dir.path().join("s.toml")).is_err());
    }

    #[test]
    fn damaged_scene_files_are_refused_or_read(
        cut in 0..SCENE.len(),
        length in 0..40_usize,
        put in prop_oneof!["\\PC{0,12}", "[\\[\\]={}\",.0-9a-z\n]{0,12}"],
    ) {
        let end = (cut + length).min(SCENE.len());
        let text = format!("{}{put}{}", &SCENE[..cut], &SCENE[end..]);
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("m.obj"), obj("usemtl lamp", "f 1 2 3")).unwrap();
        fs::write(dir.path().join(MTL.0), MTL.1).unwrap();
        if let Err(error) = Scene::from_toml(&text, dir.path().join("s.toml")) {
            prop_assert!(!error.to_string().contains('\n'), "{}", error);
        }
    }
}
