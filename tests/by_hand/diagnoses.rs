//! Mistakes that are planted, in points that follow another density as evenly as can be: what the diagnosis calls them, and by which figures.

use super::*;
use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::LazyLock;
use warpcheck::domain::{Discrete, Disk, Hemisphere, Interval, Knots, MeshSurface, Sphere, Square};
use warpcheck::verify::{Diagnosis, Row, Settings, recording};

/// With no check but the one that counts.
fn by_chi_square() -> Settings {
    let others = checks().map(|(name, _)| name.to_owned()).filter(|name| name != "chi-square");
    Settings { without: others.collect(), ..Settings::default() }
}

/// The diagnosis of so many points that follow `actual`, a density per measure up to a constant of which `most` is the largest per chart area, where
/// `claimed` is said of them.
fn diagnosed<D: Domain>(
    domain: D,
    knots: Knots,
    claimed: impl Fn(&D::Point) -> f64 + Send + Sync,
    actual: impl Fn(&D::Point) -> f64,
    most: f64,
) -> Option<Diagnosis> {
    const COUNT: usize = 8_000;
    // Multiples of the powers of the root of x^5 = x + 1 fill a cube of four dimensions evenly.
    let steps = [0.856_674_883_854_503, 0.733_891_856_627_126, 0.628_706_721_037_809, 0.538_597_257_223_61];
    let mut numbers = Vec::with_capacity(3 * COUNT);
    for i in 1.. {
        let [a, b, c, d] = steps.map(|step| (f64::from(i) * step).fract());
        let patch = (c * domain.patches() as f64) as usize;
        let at = [a, b];
        let (point, jacobian) = domain.point(patch, at);
        let density = actual(&point) * jacobian;
        assert!(density <= most * (1.0 + 1e-9), "{density} at {point:?}");
        if d * most < density {
            numbers.extend([patch as f64, a, b]);
            if numbers.len() == 3 * COUNT {
                break;
            }
        }
    }
    let own = domain.clone();
    let row = move |n: &[f64]| Row {
        point: Some(own.point(n[0] as usize, [n[1], n[2]]).0),
        density: None,
        weight: None,
    };
    let recording = recording(domain, Given::new(3, numbers), row).unwrap().density(claimed).knots(knots);
    recording.examine(&by_chi_square()).unwrap().diagnosis
}

#[track_caller]
fn is(diagnosis: &Option<Diagnosis>, name: &str) -> Diagnosis {
    let diagnosis = diagnosis.as_ref().unwrap_or_else(|| panic!("no diagnosis, not {name}"));
    assert!(diagnosis.is(name), "{diagnosis:#?}\nis not {name}");
    diagnosis.clone()
}

/// A number behind some words of the text.
#[track_caller]
fn number(diagnosis: &Diagnosis, words: &str) -> f64 {
    let (_, rest) =
        diagnosis.text.split_once(words).unwrap_or_else(|| panic!("no `{words}` in {}", diagnosis.text));
    let end = rest.find(|c: char| !c.is_ascii_digit() && !".-+e".contains(c)).unwrap_or(rest.len());
    rest[..end]
        .trim_end_matches('.')
        .parse()
        .unwrap_or_else(|_| panic!("no number behind `{words}` in {}", diagnosis.text))
}

type OnSquare = fn(f64, f64) -> f64;

fn on_a_square(claimed: OnSquare, actual: OnSquare, most: f64) -> Option<Diagnosis> {
    on_a_grid(Knots::default(), claimed, actual, most)
}

fn on_a_grid(knots: Knots, claimed: OnSquare, actual: OnSquare, most: f64) -> Option<Diagnosis> {
    diagnosed(Square, knots, move |p| claimed(p.x, p.y), move |p| actual(p.x, p.y), most)
}

#[test]
fn right_points_have_none() {
    assert_eq!(on_a_square(|_, _| 1.0, |_, _| 1.0, 1.0), None);
    assert_eq!(on_a_square(|x, _| 0.5 + x, |x, _| 0.5 + x, 1.5), None);
}

#[test]
fn factors_of_a_square() {
    let plain = "the density integrates as it should, which points to the sampler";
    let lacks = is(&on_a_square(|_, _| 1.0, |x, _| x, 1.0), "lacks x");
    assert!(
        lacks.text.starts_with("the density lacks a factor x, or the sampler has it once too often")
            && lacks.text.contains(plain),
        "{}",
        lacks.text
    );
    // ln L: the mean of ln 2 x under 2 x is ln 2 - 1/2.
    near(lacks.gain, 7_000.0 * (2.0_f64.ln() - 0.5), 0.06);
    near(number(&lacks, "ln L "), lacks.gain, 0.01);
    assert!(
        lacks.margin.unwrap() > 10.0 && lacks.others.len() == 3 && lacks.others[0].1 == lacks.margin.unwrap()
    );
    is(&on_a_square(|_, _| 1.0, |_, y| y * y, 1.0), "lacks (y)^2");
    let extra = is(&on_a_square(|x, y| 2.0 * y * (0.5 + x), |x, _| 0.5 + x, 1.5), "extra y");
    assert!(
        extra.text.starts_with("the density has a factor y too many, or the sampler lacks it"),
        "{}",
        extra.text
    );
    is(&on_a_square(|x, y| 3.0 * x * x * (0.5 + y), |_, y| 0.5 + y, 1.5), "extra (x)^2");
    // 2 does not integrate to 1, but 2 x does.
    let density = is(&on_a_square(|_, _| 2.0, |x, _| x, 1.0), "lacks x");
    assert!(
        density
            .text
            .contains("so changed the density would integrate as it should, which points to the density"),
        "{}",
        density.text
    );
    let neither = is(&on_a_square(|_, _| 3.0, |x, _| x, 1.0), "lacks x");
    assert!(!neither.text.contains("points to"), "{}", neither.text);
}

/// Whole rows of a table that has 1 all over, by the factor at their centres.
#[test]
fn factors_of_rows() {
    let of_row = |x: f64| ((4.0 * x).floor() + 0.5) / 4.0;
    let rows = is(
        &on_a_grid(Knots::grid(4, 1), |_, _| 1.0, |x, _| ((4.0 * x).floor() + 0.5) / 4.0, 0.875),
        "lacks x",
    );
    assert!(!rows.text.contains("is left"), "{}", rows.text);
    let gain: f64 = [0.1, 0.3, 0.6, 0.8].map(|x| 2.0 * of_row(x) * (2.0 * of_row(x)).ln()).iter().sum();
    near(rows.gain, 7_000.0 * gain / 4.0, 0.02);
}

#[test]
fn powers_and_shares() {
    let claimed: OnSquare = |x, _| (0.2 + x).powi(2) / 0.573_333_333_333_333_3;
    is(&on_a_square(claimed, |x, _| (0.2 + x).powi(4), 2.08), "density squared");
    is(&on_a_square(claimed, |x, _| 0.2 + x, 1.2), "density's square root");
    let power = is(&on_a_square(claimed, |x, _| (0.2 + x).powf(1.4), 1.3), "power");
    near(number(&power, "the samples follow the density to the power "), 0.7, 5e-3);
    let share =
        is(&on_a_square(|x, _| 0.2 + 1.6 * x, |x, _| 0.6 * (0.2 + 1.6 * x) + 0.4, 1.48), "share of uniform");
    near(number(&share, "a share of "), 40.0, 0.02);
    let share =
        is(&on_a_square(|x, _| 0.6 * (0.2 + 1.6 * x) + 0.4, |x, _| 0.2 + 1.6 * x, 1.8), "share of uniform");
    near(number(&share, "the density claims "), 200.0 / 3.0, 0.02);
    assert!(share.text.contains("% too much of a part: uniform"), "{}", share.text);
    is(&on_a_square(|x, y| 0.2 + 1.6 * x * 2.0 * y * 0.5 + 0.4, |_, _| 1.0, 1.0), "uniform");
}

/// Densities are raised to powers whatever unit they are per.
#[test]
fn powers_of_large_densities() {
    const SHORT: f64 = 1e-100;
    let claimed = |x: &f64| (0.2 + x / SHORT).powi(2) / 0.573_333_333_333_333_3 / SHORT;
    let actual = |x: &f64| (0.2 + x / SHORT).powi(4) / SHORT;
    is(&diagnosed(Interval::new(0.0, SHORT), Knots::default(), claimed, actual, 2.08), "density squared");
}

/// The rows of a table are on a domain of two axes.
#[test]
fn entries_of_a_line() {
    let table = |x: &f64| [1.0, 3.0, 2.0, 2.0][(4.0 * x) as usize] / 2.0;
    let even = is(&diagnosed(Interval::new(0.0, 1.0), Knots::grid(4, 1), table, |_| 1.0, 1.0), "uniform");
    assert!(!even.is("rows chosen alike") && !even.is("rows normalised"), "{even:?}");
}

#[test]
fn places_taken_for_others() {
    let claimed: OnSquare = |x, y| 0.2 + 0.8 * x + 1.2 * x * y + 0.1;
    for (name, actual) in [
        ("x mirrored", (|x, y| 1.1 - 0.8 * x + 1.2 * (1.0 - x) * y) as OnSquare),
        ("y mirrored", |x, y| 0.3 + 0.8 * x + 1.2 * x * (1.0 - y)),
        ("x and y mirrored", |x, y| 1.1 - 0.8 * x + 1.2 * (1.0 - x) * (1.0 - y)),
        ("x and y exchanged", |x, y| 0.3 + 0.8 * y + 1.2 * x * y),
        ("a quarter turn off", |x, y| 0.3 + 0.8 * y + 1.2 * y * (1.0 - x)),
    ] {
        let diagnosis = is(&on_a_square(claimed, actual, 2.3), name);
        assert!(
            diagnosis.text.starts_with(&format!("{name}, in either the sampler or the density")),
            "{}",
            diagnosis.text
        );
    }
    let line = |x: &f64| 0.5 + x;
    is(&diagnosed(Interval::new(0.0, 1.0), Knots::default(), line, |x| 1.5 - x, 1.5), "mirrored");
    let exchanged = diagnosed(
        Disk,
        Knots::default(),
        |p| (0.5 + p.length()) * 0.857_142_857 * FRAC_1_PI,
        |p| {
            let (r, phi) = (p.length(), p.y.atan2(p.x).rem_euclid(2.0 * PI) / (2.0 * PI));
            (0.5 + phi) * phi / r.max(1e-9)
        },
        1.5 * 2.0 * PI,
    );
    is(&exchanged, "r and phi exchanged");
}

#[test]
fn steps_holes_and_crowds() {
    let step = is(&on_a_square(|_, _| 1.0, |x, _| if x < 0.3 { 1.0 } else { 2.0 }, 2.0), "step along x");
    near(number(&step, "from x at "), 0.3, 0.05);
    near(number(&step, "on there are "), 2.0 / 1.7, 0.03);
    near(number(&step, "says, before "), 1.0 / 1.7, 0.1);
    let holed = diagnosed(
        Interval::new(0.0, 1.0),
        Knots::default(),
        |_| 1.0,
        |x| if (0.2..0.5).contains(x) { 0.0 } else { 1.0 },
        1.0,
    );
    let hole = is(&holed, "hole");
    let held = number(&hole, "there are no samples where the density has ");
    assert!(
        (25.0..31.0).contains(&held) && hole.text.contains("% of its mass, for one at x 0.1"),
        "{}",
        hole.text
    );
    let crowd = is(
        &on_a_square(
            |_, _| 1.0,
            |x, y| if (x - 0.52).abs() < 0.01 && (y - 0.31).abs() < 0.01 { 101.0 } else { 1.0 },
            101.0,
        ),
        "crowd",
    );
    assert!(crowd.text.contains("% of the samples crowd where the density has "), "{}", crowd.text);
    let odd =
        on_a_square(|_, _| 1.0, |x, y| 1.0 + (20.0 * x).sin() * (17.0 * y * (1.0 + x)).sin(), 2.0).unwrap();
    assert!(
        !odd.explains && odd.name == "unknown" && odd.margin.is_none() && odd.gain == 0.0 || odd.gain > 0.0,
        "{odd:?}"
    );
    assert!(
        odd.text.starts_with("none of the ") && odd.text.contains(" known mistakes explains the counts in 1"),
        "{}",
        odd.text
    );
}

#[test]
fn constants() {
    for (claimed, name) in [
        ((|_, _| 2.0) as OnSquare, "constant 2"),
        (|_, _| 0.25, "constant 1 / 4"),
        (|_, _| PI, "constant pi"),
    ] {
        let diagnosis = is(&on_a_square(claimed, |_, _| 1.0, 1.0), name);
        let words = name.split_once(' ').unwrap().1;
        assert!(diagnosis.text.starts_with(&format!("the shape of the density is right, but it is {words} times what it should be; its integral is ")), "{}", diagnosis.text);
        assert!(diagnosis.text.ends_with(" where 1.000000 of the samples are drawn"), "{}", diagnosis.text);
        let c = claimed(0.5, 0.5);
        // Of n samples that expect c n, by Poisson's distribution.
        let left_over = if c < 1.0 { 7_000.0 * (1.0 - c) } else { 0.0 };
        near(diagnosis.gain, 7_000.0 * (c - 1.0 - c.ln()) + left_over, 1e-2);
    }
    let off = is(&on_a_square(|_, _| 1.3, |_, _| 1.0, 1.0), "constant");
    assert!(
        off.text.contains("but its normalisation is off by +30.0000%; its integral is 1.300000"),
        "{}",
        off.text
    );
    let again = is(&on_a_square(|_, _| 0.87, |_, _| 1.0, 1.0), "rejected samples drawn again");
    assert!(again.text.contains("not raised by 1.149425 = 1 / (1 - rejected)"), "{}", again.text);
    // Of other shape, and of a shape that is right where only the constant is.
    is(&on_a_square(|x, _| 2.0 * (0.5 + x), |x, _| 0.5 + x, 1.5), "constant 2");
}

const ROWS: usize = 8;
const COLUMNS: usize = 4;

/// An entry of a table that has no symmetry.
fn value(row: usize, column: usize) -> f64 {
    let (rows, columns) = ([1.0, 4.0, 2.0, 7.0, 3.0, 8.0, 5.0, 2.0], [3.0, 1.0, 2.0, 4.0]);
    rows[row] * columns[column] / 80.0 + ((row * 4 + column) % 3) as f64 * 0.1
}

/// The entry at a place; none outside.
fn looked_up(x: f64, y: f64) -> f64 {
    let inside = (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y);
    if inside { value((x * ROWS as f64) as usize, (y * COLUMNS as f64) as usize) } else { 0.0 }
}

fn row_sum(x: f64) -> f64 {
    (0..COLUMNS).map(|column| value((x * ROWS as f64) as usize, column)).sum()
}

fn of_a_table(actual: OnSquare) -> Option<Diagnosis> {
    static MEAN: LazyLock<f64> = LazyLock::new(|| {
        (0..ROWS * COLUMNS).map(|i| value(i / COLUMNS, i % COLUMNS)).sum::<f64>() / (ROWS * COLUMNS) as f64
    });
    on_a_grid(Knots::grid(ROWS, COLUMNS), |x, y| looked_up(x, y) / *MEAN, actual, 1.0)
}

#[track_caller]
fn is_said_of_a_table(name: &str, words: &str, actual: OnSquare) {
    let diagnosis = is(&of_a_table(actual), name);
    assert!(diagnosis.text.starts_with(words), "{}", diagnosis.text);
}

#[test]
fn tables_looked_up_beside() {
    assert_eq!(of_a_table(looked_up), None);
    is_said_of_a_table(
        "half a cell off along x",
        "samples lie half a cell ahead along x of where the density has them",
        |x, y| looked_up(x - 0.0625, y),
    );
    is_said_of_a_table("half a cell off along x", "samples lie half a cell behind along x", |x, y| {
        looked_up(x + 0.0625, y)
    });
}

#[test]
fn tables_looked_up_one_cell_off() {
    is_said_of_a_table("one cell off along y", "samples lie one cell ahead along y", |x, y| {
        looked_up(x, y - 0.25)
    });
    is_said_of_a_table("one cell off along y", "samples lie one cell behind along y", |x, y| {
        looked_up(x, y + 0.25)
    });
}

#[test]
fn tables_that_are_stretched() {
    is_said_of_a_table("stretched along x", "places along x are divided by one cell too many", |x, y| {
        looked_up(x * 9.0 / 8.0, y)
    });
    is_said_of_a_table("stretched along y", "places along y are divided by one cell too few", |x, y| {
        looked_up(x, y * 0.75)
    });
}

#[test]
fn tables_by_columns_and_rows() {
    is_said_of_a_table(
        "table read by columns",
        "texels are numbered by columns where they are numbered by rows",
        |x, y| {
            let index = (y * COLUMNS as f64) as usize * ROWS + (x * ROWS as f64) as usize;
            value(index / COLUMNS, index % COLUMNS)
        },
    );
    is(&of_a_table(|x, y| looked_up(x, y) / row_sum(x)), "rows normalised");
    is(&of_a_table(|x, y| looked_up(x, y) / row_sum(x)), "rows chosen alike");
}

/// Rows of several sizes, each with a slope of its own.
#[test]
fn rows_of_several_sizes() {
    const SIZES: [f64; 4] = [0.2, 0.3, 0.1, 0.4];
    let row = |x: f64| [0.2, 0.5, 0.6].iter().filter(|&&end| end <= x).count();
    let within = |row: usize, y: f64| if row.is_multiple_of(2) { 0.5 + y } else { 1.5 - y };
    let judged = |weight: &dyn Fn(usize) -> f64| {
        let claimed = move |p: &glam::DVec2| [1.0, 3.0, 2.0, 0.5][row(p.x)] / 1.5 * within(row(p.x), p.y);
        let actual = |p: &glam::DVec2| weight(row(p.x)) * within(row(p.x), p.y);
        let knots = Knots { axes: [vec![0.2, 0.5, 0.6], vec![]] };
        diagnosed(Square, knots, claimed, actual, 15.0)
    };
    let each = is(&judged(&|_| 1.0), "rows normalised");
    assert!(
        each.text.starts_with("rows are normalised each on its own") && !each.is("rows chosen alike"),
        "{each:?}"
    );
    let alike = is(&judged(&|row| 1.0 / SIZES[row]), "rows chosen alike");
    assert!(
        alike.text.starts_with("all rows are chosen with the same probability")
            && !alike.is("rows normalised"),
        "{alike:?}"
    );
}

#[test]
fn factors_of_directions() {
    let hemisphere = |claimed: fn(f64) -> f64, actual: fn(f64) -> f64| {
        diagnosed(Hemisphere, Knots::default(), move |w| claimed(w.z), move |w| actual(w.z), PI * PI)
    };
    let cosine = is(&hemisphere(|_| 0.5 * FRAC_1_PI, |z| z), "lacks cos theta");
    assert!(cosine.is("cosine-weighted"));
    // About +Z it has no axis of its own.
    assert!(!cosine.alike.iter().any(|name| name.contains("axis")), "{cosine:?}");
    is(&hemisphere(|_| 0.5 * FRAC_1_PI, |z| (1.0 - z * z).sqrt()), "lacks sin theta");
    is(&hemisphere(|z| z * FRAC_1_PI, |_| 1.0), "uniform");
    is(&hemisphere(|z| 1.5 * z * z * FRAC_1_PI, |z| 1.0 - z * z), "sin theta and cos theta exchanged");
}

/// A lobe that is not about +Z has a sine and a cosine of its own.
#[test]
fn factors_about_an_oblique_axis() {
    let axis = glam::DVec3::new(0.6, 0.0, 0.8);
    let lobe = |times: f64, actual: fn(f64) -> f64| {
        let claimed = move |w: &glam::DVec3| times * 5.0 / (2.0 * PI) * w.dot(axis).max(0.0).powi(4);
        diagnosed(Sphere, Knots::default(), claimed, move |w| actual(w.dot(axis)), 2.0 * PI * PI)
    };
    // Whatever the density integrates to.
    is(&lobe(0.25, |c| c.max(0.0).powi(5)), "lacks cos of the angle to the lobe's axis");
    let lobe = |actual: fn(f64) -> f64| lobe(1.0, actual);
    is(&lobe(|c| c.max(0.0).powi(5)), "lacks cos of the angle to the lobe's axis");
    is(
        &lobe(|c| c.max(0.0).powi(4) * (1.0 - c * c).max(0.0).sqrt()),
        "lacks sin of the angle to the lobe's axis",
    );
    is(&lobe(|c| (-c).max(0.0).powi(4)), "opposite direction");
}

/// The axis is that of the density, not of the samples: an even one has none.
#[test]
fn no_factors_about_the_axis_of_the_samples() {
    let axis = glam::DVec3::new(0.6, 0.0, 0.8);
    let even = diagnosed(
        Sphere,
        Knots::default(),
        |_| 0.25 * FRAC_1_PI,
        move |w| w.dot(axis).max(0.0),
        2.0 * PI * PI,
    );
    let named = even.iter().flat_map(|d| std::iter::once(&d.name).chain(&d.alike)).collect::<Vec<_>>();
    assert!(!named.is_empty() && !named.iter().any(|name| name.contains("axis")), "{even:?}");
}

#[test]
fn shifts_go_around() {
    let table = |rotated: f64| {
        move |w: &glam::DVec3| {
            let phi = (w.y.atan2(w.x) / (2.0 * PI) + rotated).rem_euclid(1.0);
            [1.0, 3.0, 2.0, 6.0, 1.0, 5.0, 4.0, 2.0][((phi * 8.0) as usize).min(7)] / (12.0 * PI)
        }
    };
    let off = diagnosed(Sphere, Knots::grid(4, 8), table(0.0), table(-0.0625), PI * PI / 3.0);
    let off = is(&off, "half a cell off along phi");
    assert!(off.text.starts_with("samples lie half a cell ahead along phi"), "{}", off.text);
    is(
        &diagnosed(Sphere, Knots::grid(4, 8), table(0.0), table(0.125), PI * PI / 3.0),
        "one cell off along phi",
    );
}

#[test]
fn patches_of_a_mesh() {
    let areas = [1.0, 2.0, 0.5, 3.0];
    let judge = |claimed: [f64; 4], actual: [f64; 4]| {
        diagnosed(
            MeshSurface::from_areas(areas.to_vec()),
            Knots::default(),
            move |p| claimed[p.triangle],
            move |p| actual[p.triangle],
            40.0,
        )
    };
    let uniform = [1.0 / 6.5; 4];
    let each = areas.map(|a| 0.25 / a);
    is(&judge(uniform, each), "patches chosen alike");
    is(&judge(each, [1.0; 4]), "lacks the patch's measure");
    is(&judge(areas.map(|a| a / 14.25), [1.0; 4]), "extra patch's measure");
    let some = [0.4, 0.1, 0.3, 0.2 / 3.0];
    let mass = [0, 1, 2, 3].map(|i| some[i] * areas[i]);
    let total: f64 = mass.iter().sum();
    let claimed = some.map(|d| d / total);
    is(
        &judge(claimed, [0, 1, 2, 3].map(|i| claimed[i] * mass[i] / total)),
        "lacks the selection probability",
    );
}

#[test]
fn two_patches_are_chosen_alike() {
    let chosen = diagnosed(
        MeshSurface::from_areas(vec![1.0, 3.0]),
        Knots::default(),
        |_| 0.25,
        |p| [3.0, 1.0][p.triangle],
        6.0,
    );
    is(&chosen, "patches chosen alike");
}

/// Densities that a sampler or its user names are known mistakes, and so are shares of them.
#[test]
fn rivals_that_samples_follow() {
    let rival = |&x: &f64| if (0.25..0.5).contains(&x) { 3.0 } else { 1.0 / 3.0 };
    let judged = |share: f64| {
        // Three quarters of the rival's samples are in the second quarter, and the others all over the rest.
        let rest = |u: f64| if u < 0.25 { u } else { u + 0.25 };
        let of_rival = move |u: f64| if u < 0.75 { 0.25 + u / 3.0 } else { rest(3.0 * (u - 0.75)) };
        let sample = move |xi: &[f64]| {
            let point = if xi[0] < share { of_rival(xi[1]) } else { xi[1] };
            Some(Sample { point, density: 1.0 })
        };
        let sampler = Told { dimensions: 2, ..Told::new(Interval::new(0.0, 1.0), sample, |_| 1.0) };
        let settings = Settings { samples: 8_000, ..by_chi_square() };
        warpcheck::verify(&sampler).settings(settings).rival("the other lamp", rival).examine().diagnosis
    };
    let whole = is(&judged(1.0), "the other lamp");
    assert!(whole.text.starts_with("the samples follow another density: the other lamp"), "{}", whole.text);
    let part = is(&judged(0.4), "share of the other lamp");
    near(number(&part, "a share of "), 40.0, 0.1);
}

/// Which cells are compared does not depend on the unit of a density.
#[test]
fn cells_do_not_depend_on_constants() {
    let cells = |times: f64| {
        // A pattern that no known mistake leaves.
        let wave = |p: &glam::DVec2| 1.0 + (20.0 * p.x).sin() * (17.0 * p.y * (1.0 + p.x)).sin();
        let claimed = move |p: &glam::DVec2| times * (0.5 + p.x);
        let actual = |p: &glam::DVec2| (0.5 + p.x) * wave(p);
        let unknown = diagnosed(Square, Knots::default(), claimed, actual, 3.0).unwrap();
        number(&unknown, " known mistakes explains the counts in ")
    };
    let right = cells(1.0);
    assert_eq!([cells(1e-3), cells(1e3)], [right; 2]);
}

/// Entries in so many copies, each after an eighth that are pilots.
fn entries(masses: &[f64], counts: &[u64]) -> Option<Diagnosis> {
    let all: u64 = counts.iter().sum();
    assert_eq!(all % 7, 0);
    let pilots = (0..all as usize / 7).map(|i| i % masses.len()).collect::<Vec<_>>();
    let judged =
        shuffled(counts.iter().enumerate().flat_map(|(i, &count)| vec![i; count as usize]).collect());
    let rows = Given::new(1, pilots.into_iter().chain(judged).map(|i| i as f64).collect());
    let row = move |n: &[f64]| Row { point: Some(n[0] as usize), density: None, weight: None };
    recording(Discrete::new(masses.len()), rows, row)
        .unwrap()
        .density(|&i| masses[i])
        .examine(&by_chi_square())
        .unwrap()
        .diagnosis
}

#[test]
fn entries_in_figures() {
    let even = [1.0 / 40.0; 40];
    let n = 40.0 * 175.0;
    // From entry 30 on nothing: 4/3 of what is claimed before it.
    let tail: Vec<u64> = (0..40).map(|i| if i < 30 { 233 } else { 0 }).collect();
    let tail: Vec<u64> =
        tail.iter().enumerate().map(|(i, c)| c + if i == 0 { 7 - (30 * 233) % 7 } else { 0 }).collect();
    let absorbed = is(&entries(&even, &tail), "absorbed tail");
    assert!(absorbed.is("hole") && absorbed.text.starts_with("from index 30 on there are 0.0000 times the samples that the density says, before 1.3333 times: a sum that stalls"), "{}", absorbed.text);
    let drawn: f64 = tail.iter().sum::<u64>() as f64;
    near(absorbed.gain, drawn * (4.0_f64 / 3.0).ln(), 1e-3);
    // A tail is absorbed of which less than a twentieth of what is before it is left: 11 of 230, not 12.
    let tail = |left: u64, more: u64| -> Vec<u64> {
        (0..40).map(|i| if i >= 30 { left } else { 230 + if i == 0 { more } else { 0 } }).collect()
    };
    for (left, more, name) in
        [(9, 3, "absorbed tail"), (11, 4, "absorbed tail"), (12, 1, "step along the index")]
    {
        is(&entries(&even, &tail(left, more)), name);
    }
    // A quarter more from entry 20 on.
    let step: Vec<u64> = (0..40).map(|i| if i < 20 { 168 } else { 210 }).collect();
    let found = is(&entries(&even, &step), "step along the index");
    assert!(
        found.text.starts_with(
            "from index 20 on there are 1.1111 times the samples that the density says, before 0.8889 times"
        ),
        "{}",
        found.text
    );
    let g = |counts: &[u64], masses: &[f64]| {
        let n: f64 = counts.iter().sum::<u64>() as f64;
        counts
            .iter()
            .zip(masses)
            .map(|(&o, m)| {
                if o > 0 {
                    2.0 * (o as f64 * (o as f64 / (n * m)).ln() + n * m - o as f64)
                } else {
                    2.0 * n * m
                }
            })
            .sum::<f64>()
    };
    near(found.gain, 0.5 * g(&step, &even), 1e-4);
    // Where one at either end has no mass a single sample of it is no step.
    let stray: Vec<u64> = (0..33)
        .map(|i| [1, 168, 210][usize::from(i > 0) + usize::from(i > 16)] + if i == 5 { 6 } else { 0 })
        .collect();
    let masses: Vec<f64> = (0..33).map(|i| if i < 1 { 0.0 } else { 1.0 / 32.0 }).collect();
    let reversed = |all: &[f64]| all.iter().rev().copied().collect::<Vec<f64>>();
    let first = is(&entries(&masses, &stray), "step along the index");
    assert!(first.text.starts_with("from index 17 on there are 1.1"), "{}", first.text);
    let stray: Vec<u64> = stray.into_iter().rev().collect();
    let last = is(&entries(&reversed(&masses), &stray), "step along the index");
    assert!(last.text.starts_with("from index 16 on there are 0.8"), "{}", last.text);
    // All that were left over went to the last one.
    let rest: Vec<u64> = (0..40).map(|i| if i < 39 { 168 } else { 168 + 7 * 40 }).collect();
    is(&entries(&even, &rest), "the rest goes to the last entry");
    // One in the place of another, one off, and the other way round.
    let uneven: Vec<f64> = (0..40).map(|i| (3.0 + f64::from((i * 7) % 11)) / 320.0).collect();
    let total: f64 = uneven.iter().sum();
    let uneven: Vec<f64> = uneven.iter().map(|m| m / total).collect();
    let counts = |of: &dyn Fn(usize) -> f64| {
        let mut counts: Vec<u64> = (0..40).map(|i| (n * of(i)).round() as u64).collect();
        counts[1] += 7 - counts.iter().sum::<u64>() % 7;
        counts
    };
    assert_eq!(entries(&uneven, &counts(&|i| uneven[i])), None);
    let mass = |i: usize| uneven.get(i).copied().unwrap_or(0.0);
    is(
        &entries(&uneven, &counts(&|i| mass(i + 1) + if i == 0 { mass(0) } else { 0.0 })),
        "index one too small",
    );
    is(
        &entries(
            &uneven,
            &counts(&|i| if i == 0 { 0.0 } else { mass(i - 1) + if i == 39 { mass(39) } else { 0.0 } }),
        ),
        "index one too large",
    );
    is(&entries(&uneven, &counts(&|i| mass((i + 1) % 40))), "index one too small, wrapped around");
    is(&entries(&uneven, &counts(&|i| mass((i + 39) % 40))), "index one too large, wrapped around");
    is(&entries(&uneven, &counts(&|i| mass(39 - i))), "indices reversed");
    // From entry 5 to entry 12, nine tenths of its mass.
    let moved = counts(&|i| {
        mass(i)
            + match i {
                5 => -0.9 * mass(5),
                12 => 0.9 * mass(5),
                _ => 0.0,
            }
    });
    let found = is(&entries(&uneven, &moved), "mass moved between entries");
    near(number(&found, "a probability of "), 0.9 * mass(5), 0.02);
    assert!(
        found.text.contains(" moved from index 5 to index 12: an entry of a table that was not filled"),
        "{}",
        found.text
    );
    let more = counts(&|i| {
        mass(i)
            + match i {
                3 => -0.9 * mass(3),
                11 | 22 => 0.45 * mass(3),
                _ => 0.0,
            }
    });
    let found = is(&entries(&uneven, &more), "mass moved between entries");
    assert!(
        found.text.contains(" moved from 1 entries, first index 3, to 2, first index "),
        "{}",
        found.text
    );
    let share = entries(&uneven, &counts(&|i| 0.7 * mass(i) + 0.3 / 40.0));
    near(number(&is(&share, "share of uniform"), "a share of "), 30.0, 0.02);
    // That all are drawn alike has one name, and two cells are enough for it.
    let alike = is(&entries(&uneven, &[175; 40]), "uniform");
    assert!(!alike.is("patches chosen alike"), "{alike:?}");
    is(&entries(&[0.3, 0.7], &[3500; 2]), "uniform");
    let squares: f64 = uneven.iter().map(|m| m * m).sum();
    is(&entries(&uneven, &counts(&|i| mass(i) * mass(i) / squares)), "density squared");
}
