//! Samplers that are not in Rust: right ones pass, broken ones fail, and whatever can't be judged gets a sentence that names the row.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use warpcheck::random::{fill_unit, stream};
use warpcheck::sampler::{CosineHemisphere, Sampler, VonMisesFisher};

const PASS: i32 = 0;
const FAIL: i32 = 1;
const BAD: i32 = 2;

/// Exit code, standard output, standard error.
fn check(arguments: &[&str], input: &[u8]) -> (i32, String, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_warpcheck"))
        .arg("check")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It may have seen enough before all of it is written.
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[track_caller]
fn expect(code: i32, says: &str, arguments: &[&str], input: &[u8]) {
    let (found, out, err) = check(arguments, input);
    assert_eq!(found, code, "{arguments:?}\n{out}\n{err}");
    assert!(out.contains(says) || err.contains(says), "`{says}` is not said\n{out}\n{err}");
    if code == BAD {
        assert_eq!(err.lines().count(), 1, "one sentence: {err}");
    }
}

/// Rows of point and density.
fn rows<S: Sampler>(
    sampler: &S,
    count: usize,
    row: impl Fn(&warpcheck::sampler::Sample<warpcheck::sampler::PointOf<S>>) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let mut rng = stream(1, "foreign", 0);
    let mut xi = vec![0.0; sampler.dimensions()];
    (0..count)
        .map(|_| {
            fill_unit(&mut rng, &mut xi);
            row(&sampler.sample(&xi).unwrap())
        })
        .collect()
}

fn cosine(count: usize) -> Vec<Vec<f64>> {
    rows(&CosineHemisphere, count, |s| vec![s.point.x, s.point.y, s.point.z, s.density])
}

fn f32s(rows: &[Vec<f64>]) -> Vec<u8> {
    rows.iter().flatten().flat_map(|x| (*x as f32).to_le_bytes()).collect()
}

fn text(rows: &[Vec<f64>], names: &str) -> String {
    let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    format!("{names}\n{}\n", rows.iter().map(line).collect::<Vec<_>>().join("\n"))
}

/// An array as NumPy writes it.
fn npy(descr: &str, fortran: bool, shape: &str, body: &[u8]) -> Vec<u8> {
    let fortran = if fortran { "True" } else { "False" };
    let descr = if descr.starts_with('[') { descr.to_owned() } else { format!("'{descr}'") };
    let mut header = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}");
    header += &" ".repeat(63 - (10 + header.len()) % 64);
    header.push('\n');
    let mut all = b"\x93NUMPY\x01\x00".to_vec();
    all.extend((header.len() as u16).to_le_bytes());
    all.extend(header.bytes());
    all.extend(body);
    all
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).unwrap();
        path.to_str().unwrap().to_owned()
    }
}

/// A cosine lobe as a table per uv: cos theta / pi times the sine and pi^2, at the centres of many rows.
fn cosine_table(folder: &Folder) -> String {
    let rows = 256;
    let value = |row: usize| {
        let theta = 0.5 * std::f64::consts::PI * (row as f64 + 0.5) / rows as f64;
        theta.cos() * theta.sin()
    };
    let body: Vec<u8> = (0..rows).flat_map(|row| value(row).to_le_bytes()).collect();
    folder.file("cosine.npy", npy("<f8", false, &format!("({rows}, 1)"), &body))
}

/// Samples with a column that is not used, against that table.
fn against(table: &str) -> [&str; 9] {
    [
        "--domain",
        "hemisphere",
        "--columns",
        "x,y,z,_:f32",
        "--density",
        table,
        "--density-measure",
        "uv",
        "--normalise",
    ]
}

#[test]
fn a_column_of_densities_is_enough() {
    let right = f32s(&cosine(100_000));
    let arguments = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32"];
    expect(PASS, "1 of 1 samplers pass", &arguments, &right);
    let wrong: Vec<Vec<f64>> =
        cosine(100_000).into_iter().map(|r| vec![r[0], r[1], r[2], 1.05 * r[3]]).collect();
    expect(FAIL, "weights (1 / density)", &arguments, &f32s(&wrong));
}

#[test]
fn every_format_reads_the_same_samples() {
    let folder = Folder::new();
    let samples = cosine(40_000);
    let columns: Vec<Vec<f64>> = (0..4).map(|c| samples.iter().map(|row| row[c]).collect()).collect();
    let bytes_of = |column: &[f64], big: bool| -> Vec<u8> {
        column.iter().flat_map(|x| if big { x.to_be_bytes() } else { x.to_le_bytes() }).collect()
    };
    let f64s: Vec<u8> = bytes_of(&samples.concat(), false);
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let deflated = stored.compression_method(zip::CompressionMethod::Deflated);
    let points: Vec<f64> = samples.iter().flat_map(|row| row[..3].to_vec()).collect();
    archive.start_file("points.npy", deflated).unwrap();
    archive.write_all(&npy("<f8", false, "(40000, 3)", &bytes_of(&points, false))).unwrap();
    archive.start_file("pdf.npy", stored).unwrap();
    archive.write_all(&npy(">f8", false, "(40000,)", &bytes_of(&columns[3], true))).unwrap();
    let archive = archive.finish().unwrap().into_inner();
    // As `np.savez(file, dirs=np.array([x, y, z]).T)` writes it.
    let mut by_columns = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    by_columns.start_file("pdf.npy", stored).unwrap();
    by_columns.write_all(&npy("<f8", false, "(40000,)", &bytes_of(&columns[3], false))).unwrap();
    by_columns.start_file("dirs.npy", deflated).unwrap();
    by_columns.write_all(&npy(">f8", true, "(40000, 3)", &bytes_of(&columns[..3].concat(), true))).unwrap();
    let by_columns = by_columns.finish().unwrap().into_inner();
    let fields = "[('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('pdf', '<f8')]";
    let turned: Vec<Vec<f64>> = samples.iter().map(|row| vec![row[3], row[0], row[1], row[2]]).collect();
    let files = [
        folder.file("c.npy", npy("<f8", false, "(40000, 4)", &f64s)),
        folder.file("f32.npy", npy("<f4", false, "(40000, 4)", &f32s(&samples))),
        folder.file("big.npy", npy(">f8", false, "(40000, 4)", &bytes_of(&samples.concat(), true))),
        folder.file("fortran.npy", npy("<f8", true, "(40000, 4)", &bytes_of(&columns.concat(), false))),
        folder.file("record.npy", npy(fields, false, "(40000,)", &f64s)),
        folder.file("both.npz", archive),
        folder.file("fortran.npz", by_columns),
        folder.file("comma.csv", text(&samples, "x,y,z,pdf")),
        folder.file("others.csv", text(&samples, "wx,wy,wz,density")),
        folder.file("blanks.txt", text(&samples, "# as numpy.savetxt writes it").replace(',', " ")),
        folder.file("bom.csv", text(&samples, "\u{feff}X,Y,Z,PDF")),
        folder
            .file("aligned.txt", text(&samples, "").trim_start().replace(',', "    ").replace('\n', "\n  ")),
        folder.file("tabs.txt", text(&samples, "  x\t\ty\tz\tpdf\r").replace(',', " \t")),
        folder.file(
            "savetxt.txt",
            text(&turned, "#\n# pdf,x,y,z").replace(',', " ").replace("# pdf x y z", "# pdf,x,y,z"),
        ),
        folder.file("words.txt", text(&turned, "# PDF X Y Z").replace(',', "\t")),
    ];
    let mut said = Vec::new();
    for file in &files {
        let (code, out, err) = check(&[file, "--domain", "hemisphere", "--name", "cosine"], &[]);
        assert_eq!(code, PASS, "{file}\n{out}\n{err}");
        // All but the time.
        said.push((file, out.lines().nth(1).unwrap().rsplit_once("  ").unwrap().0.trim_end().to_owned()));
    }
    for (file, line) in &said {
        if !file.contains("f32") {
            assert_eq!(line, &said[0].1, "{file}");
        }
    }
    // A pipe is as good as a file, also of what has to be read out of order.
    expect(PASS, "1 of 1", &["--domain", "hemisphere"], &std::fs::read(&files[0]).unwrap());
    let mut fortran = std::fs::read(&files[3]).unwrap();
    expect(PASS, "1 of 1", &["--domain", "hemisphere"], &fortran);
    // Cut off in the last column.
    fortran.truncate(fortran.len() - 8 * 20_000 - 3);
    let cut = folder.file("cut.npy", &fortran);
    for arguments in [&["--domain", "hemisphere"][..], &[&cut, "--domain", "hemisphere"]] {
        expect(BAD, " ends in the middle of row 19999: 5 of its 8 bytes are there", arguments, &fortran);
    }
    let huge = npy("<f8", true, "(4611686018427387904, 4)", &[0; 64]);
    let arguments = ["--domain", "hemisphere"];
    expect(BAD, "its shape is [4611686018427387904, 4]: nothing is so large", &arguments, &huge);
    let promised = npy("<f8", true, "(1152921504606846, 4)", &[0; 64]);
    expect(BAD, "ends before row 8, but its header promises 1152921504606846 rows", &arguments, &promised);
}

#[test]
fn what_is_malformed_is_named_by_its_row() {
    let good = cosine(5_000);
    let raw = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32"];
    expect(BAD, "standard input is empty: there are no samples", &raw, &[]);
    let mut short = f32s(&good);
    short.truncate(16 * 4321 + 6);
    expect(BAD, "standard input ends in the middle of row 4321: 6 of its 16 bytes are there", &raw, &short);
    let mut nan = good.clone();
    nan[1234][1] = f64::NAN;
    expect(BAD, "standard input, row 1234: y is NaN", &raw, &f32s(&nan));
    nan[1234][1] = 0.1;
    nan[777][3] = f64::INFINITY;
    expect(BAD, "standard input, row 777: pdf is inf", &raw, &f32s(&nan));
    let mut mixed = f32s(&good);
    mixed[16 * 2000..].as_chunks_mut::<4>().0.iter_mut().for_each(|word| word.reverse());
    expect(BAD, "standard input, row 2000: ", &raw, &mixed);
    expect(BAD, "the byte order is wrong from here on", &raw, &mixed);

    let folder = Folder::new();
    let csv = |edit: &dyn Fn(&mut Vec<String>)| {
        let mut lines: Vec<String> = text(&good, "x,y,z,pdf").lines().map(str::to_owned).collect();
        edit(&mut lines);
        folder.file("edited.csv", lines.join("\n"))
    };
    let hemisphere = |file: &str, says: &str| expect(BAD, says, &[file, "--domain", "hemisphere"], &[]);
    hemisphere(
        &csv(&|l| l[100] = "0.1,0.2,oops,0.3".into()),
        "row 99 (line 101): z is `oops`, which is no number",
    );
    hemisphere(
        &csv(&|l| l[200] = "0.1,0.2".into()),
        "row 199 (line 201) has 2 fields where there should be 4",
    );
    hemisphere(&csv(&|l| l[300] = "0,0,NaN,0.3".into()), "row 299: z is NaN");
    hemisphere(&csv(&|l| l.truncate(1)), "is empty: there are no samples");
    hemisphere(&csv(&|l| l[0] = "x,y,z,pfd".into()), "the column `pfd` is, did you mean `pdf`? (`_` leaves");
    hemisphere(&csv(&|l| l[0] = "# chance,x,y,z".into()), "nobody knows what the column `chance` is (`_`");
    hemisphere(&csv(&|l| l[0] = "pdf,x,y,Density".into()), "two columns `pdf`, `pdf` and `Density`");
    hemisphere(&csv(&|l| l[0] = "0,0,NaN,0.3".into()), "row 0: column 2 (z) is NaN");
    let commas = text(&good, "").trim_start().replace(',', ";").replace('.', ",");
    hemisphere(&folder.file("commas.csv", &commas), "its numbers have decimal commas, as in `");
    hemisphere(
        &folder.file("commas.txt", commas.replace(';', "  ")),
        "its numbers have decimal commas, as in `",
    );
    hemisphere(
        &folder.file("named.csv", format!("x;y;z;pdf\n{commas}")),
        "which is no number (decimal commas can't be read)",
    );
    hemisphere(&folder.file("letters.csv", text(&good, "\u{3b8},y,z,pdf")), "\u{3b8},y,z,pdf hold no point");
    let wide: Vec<u8> = "\u{feff}x,y,z".encode_utf16().flat_map(u16::to_le_bytes).collect();
    hemisphere(&folder.file("wide.csv", wide), "it is UTF-16");
    let upright = npy("<f4", false, "(4, 5000)", &f32s(&good));
    hemisphere(
        &folder.file("upright.npy", upright),
        "its shape is [4, 5000], but samples are rows: transpose it (a.T)",
    );
    let whole = npy("<f4", false, "(5000, 4)", &f32s(&good));
    hemisphere(
        &folder.file("short.npy", &whole[..whole.len() - 160]),
        "ends before row 4990, but its header promises 5000 rows",
    );
    hemisphere(&folder.file("cut.npy", &whole[..whole.len() - 5]), "ends in the middle of row 4999");
    hemisphere(&folder.file("header.npy", &whole[..50]), "it ends inside of the header");
    hemisphere(
        &folder.file("axes.npy", npy("<f4", false, "(5, 4, 2)", &[0; 160])),
        "its shape is [5, 4, 2]; samples are rows",
    );
    hemisphere(
        &folder.file("half.npy", npy("<f2", false, "(5, 4)", &[0; 40])),
        "its type is `<f2`; f4, f8 and integers can be read",
    );
    hemisphere(&folder.file("none.npy", npy("<f4", false, "(0, 4)", &[])), "is empty");
    hemisphere(
        &folder.file("wide.npy", npy("<f4", false, "(2, 6)", &[0; 48])),
        "there are 6 columns; say which with --columns",
    );
    hemisphere(&folder.file("bytes.bin", f32s(&good)), "it is neither text nor an array");
    hemisphere("no-such-file.npy", "can't read no-such-file.npy");
    hemisphere(&folder.file("bad.npz", b"PK\x03\x04 and nothing else"), "bad.npz");
    let index = folder.file("index.csv", "i,pdf\n0,0.5\n1,0.5\n0.5,0.5\n");
    expect(BAD, "row 2: 0.5 is no index", &[&index, "--domain", "discrete:2"], &[]);
    let points = folder.file("points.csv", text(&good, "x,y,z,_"));
    expect(BAD, "there is nothing to hold the samples against", &[&points, "--domain", "hemisphere"], &[]);
    expect(BAD, "say with --domain", &[&points], &[]);
    expect(BAD, "have no frame", &[&points, "--domain", "square", "--frame", "y-up"], &[]);
    expect(
        BAD,
        "densities are per area, uv, uniform",
        &[&points, "--domain", "square", "--measure", "solid-angle"],
        &[],
    );
    let negative = folder
        .file("negative.npy", npy("<f8", false, "(1, 2)", &[1.0_f64, -1.0].map(f64::to_le_bytes).concat()));
    expect(
        BAD,
        "row 0, column 1 of the table is -1",
        &[&points, "--domain", "hemisphere", "--density", &negative],
        &[],
    );
}

#[test]
fn numbers_of_another_type_and_columns_in_another_order_are_named() {
    let good = cosine(2_000);
    let f64s: Vec<u8> = good.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let big: Vec<u8> = good.iter().flatten().flat_map(|x| x.to_be_bytes()).collect();
    let columns = |columns| ["--domain", "hemisphere", "--columns", columns];
    let (single, double) = (columns("x,y,z,pdf:f32"), columns("x,y,z,pdf:f64"));
    expect(BAD, "; the numbers are f64, not f32", &single, &f64s);
    let first: Vec<String> = good[0][..3].iter().map(|x| format!("{x:.3}")).collect();
    expect(BAD, &format!("but as f64 it is [{}]; ", first.join(", ")), &single, &f64s);
    expect(BAD, "; the numbers are f64be, not f32", &single, &big);
    expect(BAD, "; the numbers are f32, not f64", &double, &f32s(&good));
    let turned: Vec<Vec<f64>> = good.iter().map(|row| vec![row[3], row[0], row[1], row[2]]).collect();
    expect(BAD, "columns 2 to 4 are unit vectors: is the density first? (--columns", &single, &f32s(&turned));
}

/// Angles that are none from the pole in radians end the run, with a guess at what they are.
#[test]
fn angles_of_another_kind_are_named_by_their_row() {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let angles: Vec<[f64; 3]> = cosine(4_000)
        .iter()
        .map(|row| [row[2].acos(), row[1].atan2(row[0]).rem_euclid(2.0 * PI), row[3]])
        .collect();
    let csv = |turned: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let rows: Vec<Vec<f64>> = angles.iter().map(|row| turned(*row).to_vec()).collect();
        text(&rows, "Theta,phi,pdf").into_bytes()
    };
    let arguments = ["--domain", "sphere"];
    let says = |text: Vec<u8>, is_wrong: &dyn Fn(f64) -> bool, guess: &str| {
        let lines = String::from_utf8(text.clone()).unwrap();
        let thetas: Vec<f64> =
            lines.lines().skip(1).map(|l| l.split(',').next().unwrap().parse().unwrap()).collect();
        let row = thetas.iter().position(|theta| is_wrong(*theta)).unwrap();
        let says = format!(
            "standard input, row {row}: Theta is {}; it is the angle from the pole in radians, 0 to pi{guess}\n",
            thetas[row]
        );
        expect(BAD, &says, &arguments, &text);
    };
    let beyond = |theta: f64| theta > PI + 1e-3;
    let below = |theta: f64| theta < -1e-3;
    let degrees = |[theta, phi, pdf]: [f64; 3]| [theta.to_degrees(), phi.to_degrees(), pdf];
    says(csv(&degrees), &beyond, ": are these degrees?");
    let elevation = |[theta, phi, pdf]: [f64; 3]| [90.0 - 2.0 * theta.to_degrees(), phi.to_degrees(), pdf];
    says(csv(&elevation), &|theta| beyond(theta) || below(theta), ": is it a latitude in degrees?");
    let latitude = |[theta, phi, pdf]: [f64; 3]| [FRAC_PI_2 - 2.0 * theta, phi, pdf];
    says(csv(&latitude), &below, ": is it a latitude, from the equator?");
    says(
        csv(&|[theta, phi, pdf]| [phi, theta, pdf]),
        &beyond,
        ": is it exchanged with phi, the angle around the pole?",
    );
    says(
        csv(&|[theta, phi, pdf]| [phi - PI, theta, pdf]),
        &below,
        ": is it exchanged with phi, the angle around the pole?",
    );
    // One of many tells nothing, and is wrong all the same; so is one of what samples are compared with.
    let first = angles[100][0];
    let one = csv(&|[theta, phi, pdf]| [if theta == first { 3.2 } else { theta }, phi, pdf]);
    expect(
        BAD,
        "row 100: Theta is 3.2; it is the angle from the pole in radians, 0 to pi\n",
        &arguments,
        &one,
    );
    let folder = Folder::new();
    let other = folder.file("other.csv", &one);
    let right = csv(&|row| row);
    let compared = ["--domain", "sphere", "--against", &other];
    expect(BAD, "other.csv, row 100: Theta is 3.2", &compared, &right);
    // A few digits of pi and of 0 are theirs, and rejected samples have no angle.
    let rounded = csv(&|[theta, phi, pdf]| [if theta < FRAC_PI_4 { -0.0005 } else { PI + 0.0004 }, phi, pdf]);
    let (_, _, err) = check(&arguments, &rounded);
    assert_eq!(err, "");
    let kept = csv(&|[theta, phi, pdf]| {
        [if theta < FRAC_PI_4 { 7.0 } else { theta }, phi, if theta < FRAC_PI_4 { 0.0 } else { pdf }]
    });
    let kept = String::from_utf8(kept).unwrap().replace("pdf", "kept");
    let given = ["--domain", "hemisphere", "--against", &folder.file("kept.csv", &kept)];
    let (code, _, err) = check(&given, kept.as_bytes());
    assert!(code != BAD, "{err}");
}

#[test]
fn too_few_samples_are_told_how_many_it_takes() {
    let arguments = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32"];
    expect(3, "tails too heavy for 384 samples (it takes about ", &arguments, &f32s(&cosine(438)));
}

#[test]
fn points_outside_and_impossible_densities_fail_by_their_row() {
    let raw = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32"];
    let mut samples = cosine(30_000);
    samples[20_000] = vec![0.6, 0.0, -0.8, 0.1];
    expect(FAIL, "1 of 30000 samples are outside of the domain", &raw, &f32s(&samples));
    expect(FAIL, "(row 20000)", &raw, &f32s(&samples));
    samples[20_000] = vec![0.6, 0.0, 0.8, -0.1];
    expect(FAIL, "is -0.1", &raw, &f32s(&samples));
}

/// The first rows say where cells are cut, and are no less to be samples.
#[test]
fn what_is_certain_of_a_row_is_seen_in_the_first_rows_too() {
    let raw = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32"];
    let good = cosine(30_000);
    let with = |row: usize, numbers: [f64; 4]| {
        let mut samples = good.clone();
        samples[row] = numbers.to_vec();
        f32s(&samples)
    };
    let says = |what: &str, row: usize, numbers: [f64; 4]| {
        let (code, out, err) = check(&raw, &with(row, numbers));
        assert!(code == FAIL && out.contains(what) && out.contains(&format!("(row {row})")), "{out}\n{err}");
    };
    says("1 of 30000 samples are outside of the domain", 0, [0.6, 0.0, -0.8, 0.1]);
    says("1 of 30000 samples are outside of the domain", 777, [0.606, 0.0, 0.808, 0.25]);
    says("1 of 30000 samples have an impossible density", 3749, [0.6, 0.0, 0.8, -1.0]);
    says("1 of 30000 samples are where the density is 0", 777, [0.6, 0.0, 0.8, 0.0]);
    // A table is asked of them too, and so is what samples are compared with.
    let folder = Folder::new();
    let table = cosine_table(&folder);
    expect(FAIL, "(row 777)", &against(&table), &with(777, [0.6, 0.0, -0.8, 0.1]));
    let other = folder.file("first.f32", f32s(&good));
    let compared = ["--domain", "hemisphere", "--columns", "x,y,z,_:f32", "--against", &other];
    let says = "1 samples of standard input lie outside of the domain; the first: row 777: ";
    expect(FAIL, says, &compared, &with(777, [0.6, 0.0, -0.8, 0.1]));
}

#[test]
fn a_table_is_a_density() {
    let folder = Folder::new();
    let table = cosine_table(&folder);
    let arguments = against(&table);
    expect(PASS, "1 of 1 samplers pass", &arguments, &f32s(&cosine(60_000)));
}

#[test]
#[ignore = "long: every convention is tried"]
fn a_table_is_another_density() {
    let folder = Folder::new();
    let table = cosine_table(&folder);
    let arguments = against(&table);
    let uniform =
        rows(&warpcheck::sampler::UniformHemisphere, 60_000, |s| vec![s.point.x, s.point.y, s.point.z, 0.0]);
    expect(FAIL, "diagnosis", &arguments, &f32s(&uniform));
    // Bets see it after a few thousand of a million.
    let mut anytime = arguments.to_vec();
    anytime.extend(["--anytime", "--name", "anytime"]);
    let (code, out, _) =
        check(&anytime, &f32s(&uniform.iter().cycle().take(240_000).cloned().collect::<Vec<_>>()));
    let judged: u64 = out.lines().nth(1).unwrap().split_whitespace().nth(3).unwrap().parse().unwrap();
    assert!(code == FAIL && judged <= 1 << 15, "{out}");
}

#[test]
#[ignore = "long: every convention is tried"]
fn a_table_read_by_another_measure_is_named() {
    let folder = Folder::new();
    let table = cosine_table(&folder);
    // Read per solid angle, the table is another density.
    let plain = ["--domain", "hemisphere", "--columns", "x,y,z,_:f32", "--density", &table, "--normalise"];
    expect(
        FAIL,
        "nothing is wrong (or, which looks the same here: --density-measure uv)",
        &plain,
        &f32s(&cosine(60_000)),
    );
}

#[test]
fn wrong_conventions_are_named() {
    let folder = Folder::new();
    let table = cosine_table(&folder);
    let turned = |row: &Vec<f64>| vec![row[0], row[2], -row[1], row[3]];
    let y_up: Vec<Vec<f64>> = cosine(60_000).iter().map(turned).collect();
    let arguments = against(&table);
    expect(FAIL, "if the points are read with --frame y-up, nothing is wrong", &arguments, &f32s(&y_up));
    let mut told = arguments.to_vec();
    told.extend(["--frame", "y-up"]);
    expect(PASS, "1 of 1 samplers pass", &told, &f32s(&y_up));

    // The column alone tells which way is up, since the hemisphere ends somewhere.
    let alone = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32"];
    expect(FAIL, "if the points are read with --frame y-up, nothing is wrong", &alone, &f32s(&y_up));
    let down: Vec<Vec<f64>> =
        cosine(60_000).iter().map(|row| vec![row[0], row[1], -row[2], row[3]]).collect();
    expect(FAIL, "if the points are read with --frame x,y,-z, nothing is wrong", &alone, &f32s(&down));

    let pi = std::f64::consts::PI;
    let per_uv =
        |row: &Vec<f64>| vec![row[0], row[1], row[2], row[3] * pi * pi * (1.0 - row[2] * row[2]).sqrt()];
    let per_uv: Vec<Vec<f64>> = cosine(60_000).iter().map(per_uv).collect();
    let arguments = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f64"];
    let bytes: Vec<u8> = per_uv.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    expect(FAIL, "if the densities are read with --measure uv, nothing is wrong", &arguments, &bytes);
    expect(PASS, "1 of 1", &[&arguments[..], &["--measure", "uv"]].concat(), &bytes);
}

/// Rows that are held against their own column alone, and what is to be said of them; an empty text if no mistake is to be named.
#[track_caller]
fn is_diagnosed(domain: &str, rows: &[Vec<f64>], says: &str) -> String {
    let (code, out, err) = check(&["--domain", domain, "--columns", "x,y,z,pdf:f32"], &f32s(rows));
    assert_eq!(code, FAIL, "{out}\n{err}");
    match says {
        "" => assert!(!out.contains("diagnosis"), "{out}"),
        _ => assert!(out.contains(says), "`{says}` is not said\n{out}"),
    }
    out
}

/// Of directions of a cosine lobe, with another density of their cosine.
fn is_diagnosed_of_a_lobe(claimed: &dyn Fn(f64) -> f64, says: &str) {
    let rows = cosine(30_000).into_iter().map(|row| vec![row[0], row[1], row[2], claimed(row[2])]);
    is_diagnosed("hemisphere", &rows.collect::<Vec<_>>(), says);
}

#[test]
fn mistakes_in_the_column_of_densities_are_named() {
    use std::f64::consts::{PI, TAU};
    is_diagnosed_of_a_lobe(
        &|_| 1.0 / TAU,
        "the density lacks a factor 2 cos theta, most likely: multiplied by it, nothing is wrong",
    );
    is_diagnosed_of_a_lobe(
        &|z| 2.0 * z / PI,
        "every value is 2 times what it should be (the densities, all over the domain)",
    );
    is_diagnosed_of_a_lobe(&|z| PI / z, "the column holds 1 / the density, most likely");
}

#[test]
#[ignore = "long: more of them"]
fn more_mistakes_in_the_column_of_densities_are_named() {
    use std::f64::consts::{PI, TAU};
    is_diagnosed_of_a_lobe(
        &|_| 1.0 / PI,
        "projected-solid-angle, nothing is wrong (or, which looks the same here: lacks cos theta)",
    );
    is_diagnosed_of_a_lobe(
        &|z| z * z / PI,
        "the density has a factor cos theta too many, most likely: divided by it, nothing is wrong",
    );
    is_diagnosed_of_a_lobe(&|z| (z / PI).ln(), "the column holds the logarithm of the density, most likely");

    let sphere = |height: &dyn Fn(f64) -> f64, claimed: &dyn Fn(f64) -> f64, says: &str| {
        let (mut rng, mut xi) = (stream(1, "foreign", 0), [0.0; 2]);
        let rows = (0..30_000).map(|_| {
            fill_unit(&mut rng, &mut xi);
            let (z, phi) = (height(xi[0]), TAU * xi[1]);
            let s = (1.0 - z * z).max(0.0).sqrt();
            vec![s * phi.cos(), s * phi.sin(), z, claimed(s)]
        });
        is_diagnosed("sphere", &rows.collect::<Vec<_>>(), says);
    };
    // Uniform, where the density is that of uniform theta, and the other way round.
    let uniform = |u: f64| 2.0 * u - 1.0;
    sphere(
        &uniform,
        &|s| 1.0 / (2.0 * PI * PI * s),
        "the density lacks a factor sin theta times pi / 2, most likely",
    );
    sphere(
        &|u| (PI * u).cos(),
        &|_| 0.25 / PI,
        "the density has a factor sin theta times pi / 2 too many, most likely: divided by it, nothing is wrong",
    );
}

#[test]
fn other_mistakes_in_the_column_have_no_name_but_a_place() {
    let octant = |[x, y, z]: [f64; 3], density: f64| {
        vec![x, y, z, if x > 0.0 && y > 0.0 && z > 0.0 { 1.3 * density } else { density }]
    };
    let lobe = VonMisesFisher::new(glam::Vec3::new(0.6, 0.0, 0.8), 3.0).unwrap();
    for (domain, rows) in [
        ("hemisphere", rows(&CosineHemisphere, 30_000, |s| octant(s.point.to_array(), s.density))),
        ("sphere", rows(&lobe, 30_000, |s| octant(s.point.to_array(), s.density))),
    ] {
        let said = is_diagnosed(domain, &rows, "");
        assert!(said.contains("% too high"), "{said}");
    }
}

#[test]
fn an_environment_map_with_and_without_the_sine() {
    use warpcheck::sampler::{Environment, RowWarp};
    let folder = Folder::new();
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/data/env/noon_grass_512.hdr");
    let shipped = warpcheck::picture::read(shipped).unwrap();
    // An eighth as wide: every convention that is tried integrates it again.
    let map = warpcheck::picture::Picture::from_fn(64, 32, |x, y| shipped.at(8 * x, 8 * y));
    let file = folder.file("small.exr", []);
    warpcheck::picture::write_exr(&file, &map).unwrap();
    let file = file.as_str();
    let environment =
        Environment::new(map.width(), map.height(), map.pixels().to_vec(), RowWarp::UniformV).unwrap();
    let samples = f32s(&rows(&environment, 60_000, |s| vec![s.point.x, s.point.y, s.point.z]));
    let arguments = ["--domain", "sphere", "--columns", "x,y,z:f32", "--env", file];
    expect(PASS, "1 of 1", &[&arguments[..], &["--sine"]].concat(), &samples);
    expect(FAIL, "with --sine, nothing is wrong", &arguments, &samples);
}

#[test]
fn two_files_are_compared() {
    let folder = Folder::new();
    let other = |kappa: f32, seed: u64| {
        let lobe = VonMisesFisher::new(glam::Vec3::Z, kappa).unwrap();
        let mut rng = stream(seed, "other", 0);
        let mut xi = vec![0.0; 2];
        let rows: Vec<Vec<f64>> = (0..40_000)
            .map(|_| {
                fill_unit(&mut rng, &mut xi);
                Sampler::sample(&lobe, &xi).unwrap().point.to_array().to_vec()
            })
            .collect();
        f32s(&rows)
    };
    let second = folder.file("second.bin", other(10.0, 1));
    let arguments = ["--domain", "sphere", "--columns", "x,y,z:f32", "--against", &second];
    expect(PASS, "1 of 1", &arguments, &other(10.0, 2));
    expect(FAIL, "two-sample", &arguments, &other(11.0, 2));
    // Either may be standard input, but not both.
    let turned = [&second, "--domain", "sphere", "--columns", "x,y,z:f32", "--against", "-"];
    expect(PASS, "1 of 1", &turned, &other(10.0, 2));
    expect(FAIL, "with the same samples on standard input", &turned, &other(11.0, 2));
    expect(BAD, "standard input can't be both", &turned[1..], &other(10.0, 2));
}

/// A lobe whose axis no other frame has where it is.
fn tilted(kappa: f32, seed: u64) -> Vec<Vec<f64>> {
    let lobe = VonMisesFisher::new(glam::Vec3::new(0.36, -0.48, 0.8), kappa).unwrap();
    let (mut rng, mut xi) = (stream(seed, "tilted", 0), [0.0; 2]);
    let mut point = |_| {
        fill_unit(&mut rng, &mut xi);
        Sampler::sample(&lobe, &xi).unwrap().point.to_array().to_vec()
    };
    (0..40_000).map(&mut point).collect()
}

#[test]
fn conventions_between_two_files_are_named() {
    let folder = Folder::new();
    let y_up = |rows: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        rows.into_iter().map(|row| vec![row[0], row[2], -row[1]]).collect()
    };
    let arguments = |file| ["--domain", "sphere", "--columns", "x,y,z:f32", "--against", file];
    let other = folder.file("other.bin", f32s(&tilted(10.0, 1)));
    let other = arguments(&other);
    let says = |name: &str, end: &str| {
        format!("a convention, most likely: if the points of {name} alone are read with --frame y-up, {end}")
    };
    let right = "nothing is wrong\n";
    expect(FAIL, &says("standard input", right), &other, &f32s(&y_up(tilted(10.0, 2))));
    // Whichever of the two it is.
    let turned = folder.file("turned.bin", f32s(&y_up(tilted(10.0, 1))));
    expect(FAIL, &says(&turned, right), &arguments(&turned), &f32s(&tilted(10.0, 2)));
    let alike = "the two agree, better than independent samples would";
    expect(FAIL, &says(&turned, alike), &arguments(&turned), &f32s(&tilted(10.0, 1)));
    // What is something else, turned or not, is no convention.
    for rows in [tilted(12.0, 2), y_up(tilted(12.0, 2))] {
        let (code, out, err) = check(&other, &f32s(&rows));
        assert!(code == FAIL && !out.contains("diagnosis"), "{out}\n{err}");
    }

    // Of the hemisphere it is known which of the two lies outside of it; or both do.
    let plain: Vec<Vec<f64>> = cosine(80_000).into_iter().map(|row| row[..3].to_vec()).collect();
    let (first, second) = (plain[..40_000].to_vec(), plain[40_000..].to_vec());
    let other = folder.file("y_up.bin", f32s(&y_up(second.clone())));
    let on_hemisphere = |file| ["--domain", "hemisphere", "--columns", "x,y,z:f32", "--against", file];
    let says = |whose: &str| format!("if the points{whose} are read with --frame y-up, nothing is wrong");
    let held = on_hemisphere(&other);
    expect(FAIL, &says(&format!(" of {other} alone")), &held, &f32s(&first));
    expect(FAIL, &says(""), &held, &f32s(&y_up(first.clone())));
    let other = folder.file("z_up.bin", f32s(&second));
    expect(FAIL, &says(" of standard input alone"), &on_hemisphere(&other), &f32s(&y_up(first)));

    let square = |seed: u64, point: &dyn Fn(f64, f64) -> Vec<f64>| -> Vec<u8> {
        let (mut rng, mut xi) = (stream(seed, "tilted", 0), [0.0; 2]);
        let mut row = |_| {
            fill_unit(&mut rng, &mut xi);
            point(xi[0].sqrt(), xi[1].cbrt())
        };
        f32s(&(0..40_000).map(&mut row).collect::<Vec<_>>())
    };
    let other = folder.file("square.bin", square(1, &|x, y| vec![x, y]));
    let other = ["--domain", "square", "--columns", "x,y:f32", "--against", &other];
    let says = "if the points of standard input are read with x and y exchanged, nothing is wrong";
    expect(FAIL, says, &other, &square(2, &|x, y| vec![y, x]));
}

#[test]
fn indices_that_count_from_one_are_named() {
    const WEIGHTS: [f64; 6] = [0.1, 0.2, 0.3, 0.05, 0.05, 0.3];
    let folder = Folder::new();
    let table =
        folder.file("weights.npy", npy("<f8", false, "(1, 6)", &WEIGHTS.map(f64::to_le_bytes).concat()));
    let entries = |seed: u64, row: &dyn Fn(usize) -> Vec<f64>| -> String {
        let (mut rng, mut xi) = (stream(seed, "entries", 0), [0.0]);
        let mut drawn = |_| {
            fill_unit(&mut rng, &mut xi);
            let mut left = xi[0];
            let is_left_behind = |weight: &f64| {
                left -= weight;
                left < 0.0
            };
            row(WEIGHTS.iter().position(is_left_behind).unwrap_or(5))
        };
        text(&(0..40_000).map(&mut drawn).collect::<Vec<_>>(), "i,pdf")
    };
    let from_one = entries(1, &|i| vec![i as f64 + 1.0, WEIGHTS[i]]);
    let right = entries(2, &|i| vec![i as f64, WEIGHTS[i]]);
    let alone = ["--domain", "discrete:6"];
    let held = [&alone[..], &["--density", &table]].concat();
    let other = folder.file("right.csv", &right);
    let against = [&alone[..], &["--against", &other]].concat();
    let says = "a convention, most likely: if the indices count from 1, nothing is wrong";
    for arguments in [&alone[..], &held] {
        expect(PASS, "1 of 1", arguments, right.as_bytes());
        expect(FAIL, says, arguments, from_one.as_bytes());
    }
    expect(FAIL, "indices of standard input count from 1, nothing", &against, from_one.as_bytes());
    let other = folder.file("from_one.csv", entries(3, &|i| vec![i as f64 + 1.0, WEIGHTS[i]]));
    let against_from_one = [&alone[..], &["--against", &other]].concat();
    expect(
        FAIL,
        "most likely: if the indices count from 1, nothing is wrong",
        &against_from_one,
        from_one.as_bytes(),
    );
    let says = format!("if the indices of {other} count from 1, nothing is wrong");
    expect(FAIL, &says, &against_from_one, right.as_bytes());
    // One too large without one beyond the last; counted from 1, but with the wrong densities; and chosen by others.
    let inside = entries(1, &|i| vec![(i as f64 + 1.0).min(5.0), WEIGHTS[i]]);
    let next = entries(1, &|i| vec![i as f64 + 1.0, WEIGHTS[(i + 1) % 6]]);
    let reversed = entries(1, &|i| vec![6.0 - i as f64, WEIGHTS[5 - i]]);
    for (arguments, samples) in
        [(&held, &inside), (&alone.to_vec(), &next), (&held, &reversed), (&against, &reversed)]
    {
        let (code, out, err) = check(arguments, samples.as_bytes());
        assert!(code == FAIL && !out.contains("count from 1"), "{arguments:?}\n{out}\n{err}");
    }
}

#[test]
fn weights_and_rejected_samples() {
    // The irradiance of a white sky by uniform directions, half of them thrown away.
    let rows = rows(&warpcheck::sampler::UniformHemisphere, 60_000, |s| {
        vec![s.point.x, s.point.y, s.point.z, s.density, s.point.z]
    });
    let names = ["--domain", "hemisphere", "--columns", "x,y,z,pdf,value:f32"];
    expect(PASS, "1 of 1", &[&names[..], &["--integral", "3.14159265"]].concat(), &f32s(&rows));
    expect(FAIL, "weights (f / density", &[&names[..], &["--integral", "3.0"]].concat(), &f32s(&rows));
    expect(BAD, "say with --integral", &names, &f32s(&rows));
    let halved: Vec<Vec<f64>> = rows
        .iter()
        .enumerate()
        .map(|(i, r)| vec![r[0], r[1], r[2], 0.5 * r[3], if (i * 7919 / 13) % 2 == 0 { 1.0 } else { 0.0 }])
        .collect();
    let names = ["--domain", "hemisphere", "--columns", "x,y,z,pdf,kept:f32", "--without", "independence"];
    expect(PASS, "1 of 1", &names, &f32s(&halved));
}

/// Weights are judged by their mean where nobody knows a density, and pass for nothing else.
#[test]
fn weights_alone_are_judged_by_their_mean() {
    let weights = rows(&warpcheck::sampler::UniformHemisphere, 60_000, |s| {
        vec![s.point.x, s.point.y, s.point.z, s.point.z / s.density]
    });
    let names = ["--domain", "hemisphere", "--columns", "x,y,z,weight:f32"];
    let integral = |integral| [&names[..], &["--integral", integral]].concat();
    expect(PASS, "1 of 1", &integral("3.14159265"), &f32s(&weights));
    expect(
        FAIL,
        "weights (f / density, the column of weights): the mean of f / density is 3.1",
        &integral("3"),
        &f32s(&weights),
    );
    expect(BAD, "say with --integral", &names, &f32s(&weights));
    let named = ["--domain", "hemisphere", "--columns", "x,y,z,_:f32"];
    expect(BAD, "(or --integral with a column `weight`)", &named, &f32s(&weights));
    let value = ["--domain", "hemisphere", "--columns", "x,y,z,value:f32", "--integral", "3"];
    expect(BAD, "a column of values needs one of densities, `pdf`", &value, &f32s(&weights));
    let mut below = weights.clone();
    below[40_000][2] = -below[40_000][2];
    expect(FAIL, "1 of 60000 samples are outside of the domain", &integral("3.14159265"), &f32s(&below));
    // One in two thousand is worth all of it.
    let heavy = |i: usize| if i % 2000 == 7 { 6283.0 } else { 0.0 };
    let heavy: Vec<Vec<f64>> =
        weights.iter().enumerate().map(|(i, row)| vec![row[0], row[1], row[2], heavy(i)]).collect();
    expect(3, "but its tails are too heavy, or its samples too few", &integral("3.14159265"), &f32s(&heavy));
}

/// An index of -1 is told as what it is, and what begins there is one too small.
#[test]
fn indices_below_zero() {
    let folder = Folder::new();
    let masses: [f64; 6] = [0.05, 0.1, 0.15, 0.2, 0.2, 0.3];
    let body: Vec<u8> = masses.iter().flat_map(|x| x.to_le_bytes()).collect();
    let table = folder.file("masses.npy", npy("<f8", false, "(6,)", &body));
    let mut rng = stream(1, "indices", 0);
    let mut index = || {
        let mut left = warpcheck::random::unit_f64(&mut rng);
        masses
            .iter()
            .take(5)
            .take_while(|&mass| {
                left -= mass;
                left >= 0.0
            })
            .count() as i32
    };
    let drawn: Vec<i32> = (0..60_000).map(|_| index()).collect();
    let bytes = |shift: i32| drawn.iter().flat_map(|i| (i + shift).to_le_bytes()).collect::<Vec<u8>>();
    let arguments = ["--domain", "discrete:6", "--columns", "i:i32", "--density", &table];
    expect(PASS, "1 of 1", &arguments, &bytes(0));
    let (code, out, err) = check(&arguments, &bytes(-1));
    let (count, first) =
        (drawn.iter().filter(|i| **i == 0).count(), drawn.iter().position(|i| *i == 0).unwrap());
    let says = format!(
        "{count} of 60000 samples are outside of the domain; the first: the point -1 is index -1 of 6 entries (row {first})"
    );
    assert!(
        code == FAIL && out.contains(&says) && out.contains("index one too small"),
        "{says}\n{out}\n{err}"
    );
}

#[test]
fn what_has_no_effect_is_refused() {
    for (words, says) in [
        ("--sampler a --partial", "'--sampler <CMD>' cannot be used with '--partial'"),
        ("--sampler a --integral 3", "'--sampler <CMD>' cannot be used with '--integral <NUMBER>'"),
        ("a.npy --domain sphere --timeout 3", "--timeout is for the answers of a program"),
        (
            "a.npy --against b.npy --integral 3",
            "'--against <FILE>' cannot be used with '--integral <NUMBER>'",
        ),
        ("a.npy --against b.npy --partial", "'--against <FILE>' cannot be used with '--partial'"),
        ("a.npy --against b.npy --anytime", "'--against <FILE>' cannot be used with '--anytime'"),
        ("a.npy --against b.npy --time 3", "'--against <FILE>' cannot be used with '--time <SECONDS>'"),
        (
            "a.npy --against b.npy --without scan",
            "'--against <FILE>' cannot be used with '--without <CHECK>'",
        ),
        (
            "a.npy --against b.npy --measure uv",
            "'--against <FILE>' cannot be used with '--measure <MEASURE>'",
        ),
    ] {
        expect(BAD, says, &words.split(' ').collect::<Vec<_>>(), &[]);
    }
}

#[test]
fn pictures_need_a_density_of_places() {
    let folder = Folder::new();
    let out = folder.0.path().join("out");
    let words = ["--domain", "hemisphere", "--columns", "x,y,z,pdf:f32", "--out", out.to_str().unwrap()];
    expect(
        PASS,
        "no pictures: what comes with the samples says nothing of places",
        &words,
        &f32s(&cosine(30_000)),
    );
    assert!(!out.exists(), "nothing was to be written");
    let table = cosine_table(&folder);
    let words = [&against(&table)[..], &words[4..]].concat();
    expect(PASS, "1 of 1", &words, &f32s(&cosine(30_000)));
    assert_eq!(std::fs::read_dir(out).unwrap().count(), 1);
}

/// Runs what needs a tool that may not be installed.
fn tool(name: &str) -> Option<PathBuf> {
    let found = std::env::split_paths(&std::env::var_os("PATH")?)
        .map(|folder| folder.join(name))
        .find(|p| p.is_file());
    if found.is_none() {
        assert!(
            std::env::var_os("CI").is_none(),
            "there is no {name}, which continuous integration has to have"
        );
        eprintln!("skipped: there is no {name}");
    }
    found
}

fn example(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/foreign").join(name).to_str().unwrap().to_owned()
}

#[test]
#[ignore = "long: a program in Python answers a million questions"]
fn the_python_example_is_judged_rightly() {
    let Some(python) = tool("python3") else { return };
    let command = format!("{} '{}'", python.display(), example("sampler.py"));
    expect(PASS, "1 of 1", &["--sampler", &command, "--samples", "20k"], &[]);
    let broken = format!("{command} --broken");
    let arguments = ["--sampler", &broken, "--samples", "20k"];
    expect(FAIL, "jacobian", &arguments, &[]);
}

/// A program without a density of its own, whose up is another than the table's, and one held against a table that is read by another measure.
#[test]
#[ignore = "long: a program in Python, asked under several conventions"]
fn a_program_held_against_a_table_is_turned() {
    let Some(python) = tool("python3") else { return };
    let folder = Folder::new();
    let table = cosine_table(&folder);
    let script = r#"
import math, struct, sys
print("warpcheck 1 domain=hemisphere dimensions=2 density=no", flush=True)
while line := sys.stdin.buffer.readline():
    numbers = struct.iter_unpack("<2d", sys.stdin.buffer.read(16 * int(line.split()[1])))
    answer = []
    for u, v in numbers:
        r, phi = math.sqrt(u), 2 * math.pi * v
        answer += r * math.cos(phi), math.sqrt(1 - u), -r * math.sin(phi), 0
    sys.stdout.buffer.write(struct.pack("<%dd" % len(answer), *answer))
    sys.stdout.buffer.flush()
"#;
    let command = format!("{} '{}'", python.display(), folder.file("turned.py", script));
    let held = ["--sampler", &command, "--samples", "50k", "--density", &table, "--normalise"];
    let y_up = [&held[..], &["--density-measure", "uv", "--frame", "y-up"]].concat();
    expect(PASS, "1 of 1", &y_up, &[]);
    expect(FAIL, "if the points are read with --frame y-up, nothing is wrong", &y_up[..9], &[]);
    let per_solid_angle = [&held[..], &["--frame", "y-up"]].concat();
    // Of a table that is normalised, densities per (u, v) and per (theta, phi) are the same.
    let says = "with --density-measure theta-phi, nothing is wrong (or, which looks the same here: --density-measure uv)";
    expect(FAIL, says, &per_solid_angle, &[]);
}

#[test]
#[ignore = "long: it is asked under every convention"]
fn the_c_example_is_judged_rightly() {
    let Some(cc) = tool("cc") else { return };
    let folder = Folder::new();
    let program = folder.0.path().join("sampler");
    let built =
        Command::new(cc).args(["-O2", &example("sampler.c"), "-lm", "-o"]).arg(&program).status().unwrap();
    assert!(built.success());
    let command = program.to_str().unwrap().to_owned();
    expect(PASS, "1 of 1", &["--sampler", &command, "--samples", "50k"], &[]);
    let broken = format!("{command} --broken");
    expect(FAIL, "it is too small by that constant", &["--sampler", &broken, "--samples", "50k"], &[]);
    let y_up = ["--sampler", &command, "--samples", "50k", "--frame", "y-up"];
    expect(FAIL, "if the points are read with --frame z-up, nothing is wrong", &y_up, &[]);
}

#[cfg(unix)]
#[test]
fn programs_that_misbehave_get_a_sentence() {
    let folder = Folder::new();
    let greeting = "echo warpcheck 1 domain=square dimensions=2;";
    let program = |script: &str| {
        let file = folder.file("program.sh", script);
        format!("sh {file}")
    };
    let misbehaves = |script: &str, says: &str| {
        expect(BAD, says, &["--sampler", &program(script), "--timeout", "1", "--samples", "10k"], &[]);
    };
    misbehaves("exit 3", "ended (exit status: 3) before its first line");
    misbehaves("echo hello", "the first line of");
    misbehaves("echo warpcheck 2 domain=square dimensions=2", "it speaks version 2, not 1");
    misbehaves("echo warpcheck 1 domain=square; cat > /dev/null", "`dimensions` is missing");
    misbehaves(
        "echo warpcheck 1 domain=square dimensions=2 framme=y-up; cat > /dev/null",
        "there is no key `framme`; did you mean `frame`?",
    );
    misbehaves(
        "echo warpcheck 1 domain=square dimensions=2 seed=7; cat > /dev/null",
        "there is no key `seed`; there are domain, dimensions, frame, measure, grid, density",
    );
    misbehaves("echo warpcheck 1 domain=ball dimensions=2; cat > /dev/null", "`ball` is no domain");
    for (grid, says) in [
        ("domain=square dimensions=2 grid=8", "grid=8 is not COLUMNSxROWS, such as 512x256"),
        ("domain=square dimensions=2 grid=0x4", "grid=0x4 is not COLUMNSxROWS"),
        ("domain=square dimensions=2 grid=9999x9999", "grid=9999x9999 has more than 16777216 texels"),
        ("domain=interval dimensions=1 grid=8x2", "grid=8x2 has more than the one row of an interval"),
        ("domain=triangle dimensions=2 grid=8x2", "grid=8x2 says nothing on the triangle"),
    ] {
        misbehaves(&format!("echo warpcheck 1 {grid}; cat > /dev/null"), says);
    }
    misbehaves(
        "exec sleep 30",
        "gave no answer in 1 s before its first line: is its output flushed? (--timeout gives it longer)",
    );
    misbehaves(&format!("{greeting} cat > /dev/null"), "gave no answer in 1 s when asked `sample 64`");
    misbehaves(&format!("{greeting} read question; echo it is full >&2; exit 7"), "it said: it is full");
    misbehaves(&format!("{greeting} yes"), "`y…`? Nothing but answers goes to standard output");
    expect(BAD, "can't start", &["--sampler", "/no/such/program"], &[]);
    expect(BAD, "is no command line", &["--sampler", "'"], &[]);
    let pipe = format!("{} | cat", program(greeting));
    expect(
        BAD,
        "has a bare `|`, but there is no shell between: `sh -c '…'` is one",
        &["--sampler", &pipe],
        &[],
    );
    expect(BAD, "it is `a | b`", &["--sampler", "echo a '|' b"], &[]);
}

/// Three numbers a row and 64 rows are due, 1536 bytes.
#[cfg(unix)]
#[test]
fn answers_that_are_too_short_or_too_long_are_counted() {
    let folder = Folder::new();
    let greeting = "echo warpcheck 1 domain=square dimensions=2; read question;";
    let zeros = |bytes: usize| format!("{greeting} head -c {bytes} /dev/zero;");
    let cases = [
        (
            zeros(1024),
            "wrote 1024 of 1536 bytes in 1 s when asked `sample 64`: 2 numbers a row where 3 are due; a column missing?",
        ),
        (zeros(768), "3 numbers of 32 bits a row where 3 are due; f32 for f64?"),
        (
            zeros(1000),
            "wrote 1000 of 1536 bytes in 1 s when asked `sample 64`: is all of it flushed? (--timeout",
        ),
        (
            zeros(2048),
            "wrote 512 bytes more than it was asked for when asked `sample 64`: 4 numbers a row where 3 are due; a column too many?",
        ),
        (
            format!("{greeting} echo debug; head -c 1536 /dev/zero;"),
            "wrote 6 bytes more than it was asked for when asked `sample 64`: `debug`? Nothing but answers",
        ),
        (
            format!("{greeting} echo I am a debugging aid; head -c 1000 /dev/zero;"),
            "wrote 1021 of 1536 bytes in 1 s when asked `sample 64`: `I am a debugging aid`?",
        ),
        (
            format!("{} exit 3;", zeros(1024)),
            "ended (exit status: 3) when asked `sample 64`, after 1024 of 1536 bytes: 2",
        ),
        (
            r"printf 'warpcheck 1 domain=square dimensions=2\nready\n';".to_owned(),
            "wrote 6 bytes more than it was asked for before it was asked `sample 64`: `ready`?",
        ),
    ];
    // Side by side: most of them wait for a second.
    std::thread::scope(|scope| {
        for (i, (script, says)) in cases.iter().enumerate() {
            let file = folder.file(&format!("{i}.sh"), format!("{script} cat > /dev/null"));
            scope.spawn(move || {
                expect(BAD, says, &["--sampler", &format!("sh {file}"), "--timeout", "1"], &[])
            });
        }
    });
}

/// The Python example with a line of it changed.
fn edited_example(folder: &Folder, python: &Path, from: &str, to: &str) -> String {
    let script = std::fs::read_to_string(example("sampler.py")).unwrap();
    assert!(script.contains(from));
    format!("{} '{}'", python.display(), folder.file("edited.py", script.replace(from, to)))
}

#[test]
fn columns_of_a_program_in_another_order_are_named() {
    let Some(python) = tool("python3") else { return };
    let folder = Folder::new();
    let answer = "answer += *point, pdf(*point)";
    let first = edited_example(&folder, &python, answer, "answer += pdf(*point), *point");
    expect(BAD, "columns 2 to 4 are unit vectors: is the density first?", &["--sampler", &first], &[]);
    let wide = edited_example(&folder, &python, answer, &format!("{answer}, 1.0"));
    expect(BAD, "5 numbers a row where 4 are due; a column too many?", &["--sampler", &wide], &[]);
}

/// The example with a map in the place of its lobe: 15 x 9 texels on the sphere, constant per solid angle: too many
/// edges, and too high, for quadrature that isn't told of them.
const MAP: &str = r"
def sample(u, v, s):
    i = bisect.bisect_right(CDF, s) - 1
    row, column = divmod(i, 15)
    z, phi = EDGES[row] + v * (EDGES[row + 1] - EDGES[row]), 2 * math.pi * (column + u) / 15
    r = math.sqrt(max(0.0, 1 - z * z))
    return r * math.cos(phi), r * math.sin(phi), z


def pdf(x, y, z):
    row = min(8, int(9 * math.acos(max(-1.0, min(1.0, z))) / math.pi))
    return WEIGHTS[row][min(14, int(15 * (math.atan2(y, x) / (2 * math.pi) % 1.0)))] / TOTAL


import bisect
EDGES = [math.cos(math.pi * row / 9) for row in range(10)]
WEIGHTS = [[1 + ((3 * column + 5 * row) % 7) ** 2 for column in range(15)] for row in range(9)]
CDF = [0.0]
for row in range(9):
    for weight in WEIGHTS[row]:
        CDF.append(CDF[-1] + weight * (EDGES[row] - EDGES[row + 1]) * 2 * math.pi / 15)
TOTAL = CDF.pop()
CDF = [c / TOTAL for c in CDF]
";

/// Its command; `python` says how it is run.
fn map_program(folder: &Folder, python: &Path, greeting: &str) -> String {
    let script = std::fs::read_to_string(example("sampler.py")).unwrap();
    let (from, to) = (script.find("def sample").unwrap(), script.find("print(").unwrap());
    let script = format!("{}{MAP}\n\n{}", &script[..from], &script[to..]);
    let script = script.replace("b\"sample\": 2", "b\"sample\": 3");
    let script = script.replace("domain=hemisphere dimensions=2", greeting);
    format!("{} '{}'", python.display(), folder.file("map.py", script))
}

#[test]
fn a_map_says_where_it_jumps() {
    let Some(python) = tool("python3") else { return };
    let folder = Folder::new();
    let command = map_program(&folder, &python, "domain=sphere dimensions=3 grid=15x9");
    expect(PASS, "1 of 1", &["--sampler", &command, "--samples", "20k"], &[]);
}

#[test]
#[ignore = "long: quadrature looks for the edges, in Python"]
fn a_map_that_does_not_say_where_is_told_how() {
    let Some(python) = tool("python3") else { return };
    let folder = Folder::new();
    let command = map_program(&folder, &python, "domain=sphere dimensions=3");
    expect(3, "hint: if the density jumps", &["--sampler", &command, "--samples", "20k"], &[]);
}

#[test]
fn a_program_with_a_state_is_refused() {
    let Some(python) = tool("python3") else { return };
    let folder = Folder::new();
    let random = "import random; point = sample(random.random(), numbers[1])";
    let command = edited_example(&folder, &python, "point = sample(*numbers)", random);
    expect(BAD, "asked again", &["--sampler", &command], &[]);
}
