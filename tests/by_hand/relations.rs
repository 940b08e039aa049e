//! Relations between tables: which inputs a builder is given, and what is said of a table that is wrong in one place.

use super::*;
use glam::DVec3;
use std::cell::RefCell;
use std::f64::consts::{PI, TAU};
use std::sync::Mutex;
use warpcheck::domain::{Discrete, Sphere};
use warpcheck::random::{ONE_MINUS_EPSILON_F32, ONE_MINUS_EPSILON_F64, fill_unit};
use warpcheck::sampler::{DiscreteCdf, Environment, RowWarp, Sampler, from_fn};
use warpcheck::statistics::chi_square;
use warpcheck::verify::Verdict;
use warpcheck::verify::metamorphic::{maps, weights};

fn uneven() -> Vec<f64> {
    (0..37).map(|i| if i % 6 == 0 { 0.0 } else { 1.5 + (1.7 * f64::from(i)).sin() }).collect()
}

fn times(weights: &[f64], factor: f64) -> Vec<f64> {
    weights.iter().map(|w| factor * w).collect()
}

fn only(value: f64, at: usize, others: f64) -> Vec<f64> {
    (0..37).map(|i| if i == at { value } else { others }).collect()
}

#[track_caller]
fn same(found: &[f64], expected: &[f64]) {
    let alike = found.len() == expected.len()
        && found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs() || a == b || a.is_nan() && b.is_nan());
    assert!(alike, "{found:?}, not {expected:?}");
}

/// What is said of each relation as a whole.
fn said(examination: &Examination) -> Vec<(&str, &str)> {
    let whole = examination.findings.iter().filter(|f| f.part.is_empty());
    whole.map(|f| (f.check, f.detail.as_str())).collect()
}

#[test]
fn weights_that_a_builder_is_given() {
    let given = RefCell::new(Vec::new());
    let build = |w: &[f64]| {
        given.borrow_mut().push(w.to_vec());
        DiscreteCdf::new(w)
    };
    let examination = weights(build).name("mine").samples(64).examine();
    let given = given.into_inner();
    let u = uneven();
    let tail = [&[1.0][..], &[5e-8; 100_000]].concat();
    let behind = [&[5e-8; 100_000][..], &[1.0]].concat();
    let halves: Vec<f64> = u
        .iter()
        .enumerate()
        .flat_map(|(i, w)| if i % 2 == 0 { [0.5 * w; 2] } else { [0.25 * w, 0.75 * w] })
        .collect();
    let mut expected = vec![
        u.clone(),
        u.iter().rev().copied().collect(),
        u.clone(),
        (0..37).map(|i| u[5 * i % 37]).collect(),
        tail,
        behind,
        u.clone(),
        halves,
        u.clone(),
        times(&u, 2.0_f64.powi(60)),
        u.clone(),
        times(&u, 2.0_f64.powi(-60)),
        only(1e6, 0, 1.0),
        only(1e6, 18, 1.0),
        only(1e6, 36, 1.0),
        u.clone(),
        (0..37).map(|i| f64::from(i % 2)).collect(),
        (0..37).map(|i| if (16..21).contains(&i) { 1.0 } else { 0.0 }).collect(),
        only(1.0, 0, 0.0),
        only(1.0, 36, 0.0),
    ];
    for at in [0, 18, 36] {
        for value in [f64::NAN, f64::INFINITY, -1.0] {
            let mut bad = u.clone();
            bad[at] = value;
            expected.push(bad);
        }
    }
    expected.extend([vec![0.0; 37], vec![], vec![1e38; 37]]);
    assert_eq!(given.len(), expected.len());
    given.iter().zip(&expected).for_each(|(a, b)| same(a, b));
    // Of the long tail one in four is drawn; where bits are compared, and zeros looked for, 4096.
    assert_eq!(examination.samples, 64 * 4 + 16 * 2 + 64 * 2 + 2 * 4096 + 3 * 64 + 5 * 4096);
    let expected = [
        ("scaling", "holds for 2 inputs"),
        ("permutation", "holds for 3 inputs"),
        ("refinement", "holds for 1 inputs"),
        ("bright entry", "holds for 3 inputs"),
        ("zero weights", "holds for 5 inputs"),
        ("refusal", "holds for 12 inputs"),
    ];
    assert_eq!(said(&examination), expected);
    assert_eq!((examination.name.as_str(), examination.domain), ("mine", "discrete"));
    let without = weights(DiscreteCdf::new).samples(64).without("permutation").without("refusal").examine();
    assert!(
        without.findings.iter().all(|f| f.check != "permutation" && f.check != "refusal")
            && without.findings.len() == 5
    );
    assert_eq!(
        weights(DiscreteCdf::new).without("zero weights").examine().samples - 2 * 4096 - 5 * 4096,
        65_536 * 9 + 16_384 * 2
    );
}

#[test]
fn samples_of_related_tables_are_homogeneous() {
    are_homogeneous(3001);
}

/// A dozen or so of both in each entry: some of them are light.
#[test]
fn few_samples_of_related_tables_are_homogeneous() {
    are_homogeneous(201);
}

fn are_homogeneous(samples: u64) {
    let examination = weights(DiscreteCdf::new).samples(samples).seed(5).examine();
    let u = uneven();
    let counts = |number: u64, w: &[f64], block: &dyn Fn(usize) -> usize, blocks: usize| {
        let table = DiscreteCdf::new(w).unwrap();
        let count = if w.len() > 1000 { samples.div_ceil(4) } else { samples };
        let mut counts = vec![0_u64; blocks];
        let mut rng = stream(5, "metamorphic", number);
        for _ in 0..count {
            let mut xi = [0.0];
            fill_unit(&mut rng, &mut xi);
            counts[block(Sampler::sample(&table, &xi).unwrap().point)] += 1;
        }
        counts
    };
    // Columns of fewer than 16 of both are one.
    let test = |a: &[u64], b: &[u64]| {
        let (mut first, mut second, mut light) = (vec![], vec![], (0, 0));
        for (&a, &b) in a.iter().zip(b) {
            if a + b < 16 {
                light = (light.0 + a, light.1 + b);
            } else {
                first.push(a);
                second.push(b);
            }
        }
        first.push(light.0);
        second.push(light.1);
        chi_square::two_sample(&first, &second).unwrap()
    };
    let base = |number| counts(number, &u, &|i| i, 37);
    let reversed = test(&base(0), &counts(1, &u.iter().rev().copied().collect::<Vec<_>>(), &|i| 36 - i, 37));
    let fifth =
        test(&base(2), &counts(3, &(0..37).map(|i| u[5 * i % 37]).collect::<Vec<_>>(), &|i| 5 * i % 37, 37));
    let (tail, behind) = ([&[1.0][..], &[5e-8; 100_000]].concat(), [&[5e-8; 100_000][..], &[1.0]].concat());
    let block = |i: usize| i * 128 / 100_001;
    let moved = test(&counts(4, &tail, &block, 128), &counts(5, &behind, &|i| block(100_000 - i), 128));
    let names = [
        "uneven weights, reversed against uneven weights",
        "uneven weights, every fifth against uneven weights",
        "a heavy weight behind a light tail against a heavy weight before a light tail",
    ];
    let (figure, name) =
        [reversed, fifth, moved].into_iter().zip(names).min_by(|a, b| a.0.p.total_cmp(&b.0.p)).unwrap();
    let finding = found(&examination, "permutation", "samples");
    assert_eq!(
        finding.detail,
        format!("X^2 = {:.1} at {} degrees of freedom: {name}", figure.statistic, figure.df)
    );
    near(p_of(finding).0, (3.0 * figure.p).min(1.0), 1e-9);
    let halves: Vec<f64> = u
        .iter()
        .enumerate()
        .flat_map(|(i, w)| if i % 2 == 0 { [0.5 * w; 2] } else { [0.25 * w, 0.75 * w] })
        .collect();
    let figure = test(&base(6), &counts(7, &halves, &|i| i / 2, 37));
    let finding = found(&examination, "refinement", "samples");
    assert_eq!(
        finding.detail,
        format!(
            "X^2 = {:.1} at {} degrees of freedom: uneven weights, each in two against uneven weights",
            figure.statistic, figure.df
        )
    );
    near(p_of(finding).0, figure.p.min(1.0), 1e-9);
}

/// A table by search, and its masses, for whoever wants to spoil it.
#[derive(Clone, Debug)]
struct Table {
    below: Vec<f64>,
    mass: Vec<f64>,
    /// Where a variate leads, if not where it should.
    leads: Option<usize>,
    rejects: bool,
}

impl Table {
    fn new(w: &[f64]) -> Result<Self, String> {
        let total: f64 = w.iter().sum();
        if !(w.iter().all(|&w| w >= 0.0) && total > 0.0 && total < 1e38) {
            return Err("bad weights".to_owned());
        }
        let below = w
            .iter()
            .scan(0.0, |sum, w| {
                *sum += w;
                Some(*sum / total)
            })
            .collect();
        Ok(Self { below, mass: times(w, 1.0 / total), leads: None, rejects: false })
    }

    fn sampler(self) -> impl Sampler<Domain = Discrete> {
        let Self { below, mass, leads, rejects } = self;
        let n = mass.len();
        let last = mass.iter().rposition(|&m| m > 0.0).unwrap_or(0);
        let point = move |xi: f64| leads.unwrap_or(below.partition_point(|&b| b <= xi).min(last));
        from_fn(
            Discrete::new(n),
            move |xi: f64| (!rejects || xi < 0.5).then(|| point(xi)),
            move |i: usize| mass.get(i).copied().unwrap_or(0.0),
        )
    }
}

/// What is said of one relation where `spoil` changes the tables of some weights.
fn spoiled(relation: &str, spoil: impl Fn(&[f64], &mut Table)) -> String {
    let build = |w: &[f64]| {
        // Long ones cost most, and only permutations are asked of them.
        if w.len() > 1000 && relation != "permutation" {
            return Err("not now".to_owned());
        }
        let mut table = Table::new(w)?;
        spoil(w, &mut table);
        Ok::<_, String>(table.sampler())
    };
    let examination = weights(build).samples(64).examine();
    let finding = found(&examination, relation, "");
    is_certain(finding, if finding.detail.starts_with("holds") { Verdict::Pass } else { Verdict::Fail });
    finding.detail.clone()
}

fn sum(w: &[f64]) -> f64 {
    w.iter().sum()
}

/// The mass of an entry of the uneven weights.
fn mass_of(i: usize) -> f64 {
    uneven()[i] * (1.0 / sum(&uneven()))
}

fn is_reversed(w: &[f64]) -> bool {
    w.len() == 37 && w[1] == uneven()[35]
}

#[test]
fn bits_that_scaling_changes() {
    for relation in ["scaling", "permutation", "refinement", "bright entry", "zero weights", "refusal"] {
        assert!(spoiled(relation, |_, _| {}).starts_with("holds for"));
    }
    // Bits of densities and of samples.
    let said = spoiled("scaling", |w, t| {
        if sum(w) > 1e10 && w.len() == 37 {
            t.mass[5] *= 1.0 + f64::EPSILON
        }
    });
    assert!(
        said.starts_with(
            "one of 2 inputs breaks it. uneven weights, times 2^60: the density in entry 5 is 0.0"
        ),
        "{said}"
    );
    let said = spoiled("scaling", |w, t| {
        if sum(w) < 1e-10 {
            t.leads = Some(7)
        }
    });
    let what = |i: usize| format!("{i} of density {:?}", mass_of(i));
    assert_eq!(
        said,
        format!(
            "one of 2 inputs breaks it. uneven weights, times 2^-60: xi = [0.0] gives {}, and {} without the factor",
            what(7),
            what(1)
        )
    );
    let said = spoiled("scaling", |w, t| {
        if !(1e-10..1e10).contains(&sum(w)) {
            t.rejects = true
        }
    });
    assert!(
        said.starts_with(
            "2 of 2 inputs break it. The first: uneven weights, times 2^60: xi = [0.5] gives rejected, and "
        ),
        "{said}"
    );
}

/// Entry 3 of the reversed ones is 33 of the others. A ten-thousandth and a millionth are forgiven.
#[test]
fn masses_that_do_not_move_along() {
    let reversed = |factor: f64, plus: f64| {
        spoiled("permutation", |w, t| {
            if is_reversed(w) {
                t.mass[3] = t.mass[3] * factor + plus
            }
        })
    };
    let there = mass_of(33);
    assert_eq!(
        reversed(1.01, 0.0),
        format!(
            "one of 3 inputs breaks it. uneven weights, reversed: entry 33 of uneven weights had the mass {there:e}, and here it has {:e}",
            there * 1.01
        )
    );
    assert!(
        reversed(1.0 + 0.99e-4, 1e-6).starts_with("holds")
            && reversed(1.0 - 0.99e-4, -0.99e-6).starts_with("holds")
    );
    assert!(
        reversed(1.0 + 1.02e-4, 1e-6).starts_with("one")
            && reversed(1.0 - 1.02e-4, -1e-6).starts_with("one")
            && reversed(f64::NAN, 0.0).starts_with("one")
    );
    // Each of the tail's is off by less than anybody minds, but not blocks of 781.
    let block = spoiled("permutation", |w, t| {
        if w.len() > 1000 && w[0] < 1.0 {
            t.mass[..100_000].iter_mut().for_each(|m| *m *= 0.9)
        }
    });
    assert!(block.starts_with("one of 3 inputs breaks it. a heavy weight before and behind a light tail: block 1 of a heavy weight before a light tail had the mass "), "{block}");
    let block = spoiled("permutation", |w, t| {
        if w.len() > 1000 && w[0] < 1.0 {
            t.mass[..5000].iter_mut().for_each(|m| *m *= 0.9)
        }
    });
    assert!(block.contains(": block 121 of a heavy weight before a light tail had the mass"), "{block}");
    let refined = spoiled("refinement", |w, t| {
        if w.len() == 74 {
            t.mass[22] *= 1.01
        }
    });
    assert!(
        refined.contains("uneven weights, each in two: entry 11 of uneven weights had the mass"),
        "{refined}"
    );
}

#[test]
fn bright_and_dark_entries_of_spoiled_tables() {
    let bright = |spoil: &dyn Fn(&mut Table)| {
        spoiled("bright entry", |w, t| {
            if w[18] == 1e6 {
                spoil(t)
            }
        })
    };
    assert_eq!(
        bright(&|t| t.mass[7] = 2.0),
        "one of 3 inputs breaks it. the bright entry is middle, at index 18: the density is largest at index 7, 2e0"
    );
    assert_eq!(
        bright(&|t| t.leads = Some(3)),
        "one of 3 inputs breaks it. the bright entry is middle, at index 18: 0 of 64 samples lie there; most of them at index 3"
    );
    assert!(bright(&|t| t.below[17] = 0.3).starts_with("holds"));
    assert!(bright(&|t| t.below[17] = 0.7).contains(" of 64 samples lie there; most of them at index "));
    // Zeros.
    let zero = |spoil: &dyn Fn(&mut Table)| {
        spoiled("zero weights", |w, t| {
            if w.len() == 37 && w[16] == 1.0 && w[0] == 0.0 && w[1] == 0.0 {
                spoil(t)
            }
        })
    };
    let name = "one of 5 inputs breaks it. zeros but for five in the middle: ";
    assert_eq!(zero(&|t| t.mass[30] = 2e-6), format!("{name}the mass at index 30 is 2e-6, its weight 0"));
    assert!(zero(&|t| t.mass[30] = 1e-6).starts_with("holds"));
    assert_eq!(zero(&|t| t.leads = Some(15)), format!("{name}xi = [0.0] draws index 15, of weight 0"));
    assert!(zero(&|t| t.leads = Some(16)).starts_with("holds"));
}

/// Points beyond the end, panics, tables of another size.
#[test]
fn tables_that_break() {
    let said = spoiled("permutation", |w, t| {
        if is_reversed(w) {
            t.leads = Some(99)
        }
    });
    assert!(
        said.contains("uneven weights, reversed: xi = [")
            && said.ends_with("] gives 99, which is index 99 of 37 entries"),
        "{said}"
    );
    let said = spoiled("zero weights", |_, t| t.leads = Some(99));
    assert!(said.starts_with("5 of 5 inputs break it. The first: uneven weights: xi = [0.0] gives 99, which is index 99 of 37 entries"), "{said}");
    let said = spoiled("refinement", |w, _| assert!(w.len() != 74, "of {} weights", w.len()));
    assert_eq!(said, "one of 1 inputs breaks it. uneven weights, each in two: it panics: of 74 weights");
    let said = spoiled("refinement", |w, _| {
        if w.len() == 74 {
            panic!("plainly")
        }
    });
    assert_eq!(said, "one of 1 inputs breaks it. uneven weights, each in two: it panics: plainly");
    let said = spoiled("refinement", |w, _| {
        if w.len() == 74 {
            std::panic::panic_any(7)
        }
    });
    assert_eq!(said, "one of 1 inputs breaks it. uneven weights, each in two: it panics: no message");
    let said = spoiled("refinement", |w, t| {
        if w.len() == 37 {
            t.mass.push(0.0)
        }
    });
    assert_eq!(
        said,
        "one of 1 inputs breaks it. uneven weights, each in two: uneven weights: it has 38 entries for 37 weights"
    );
}

#[test]
fn what_is_not_refused() {
    let accepting = |bad: &dyn Fn(&[f64]) -> bool, mass: f64| {
        let build = |w: &[f64]| {
            if !bad(w) {
                return Table::new(w).map(Table::sampler);
            }
            let n = w.len().max(1);
            Ok(Table { below: vec![1.0; n], mass: vec![mass; n], leads: None, rejects: false }.sampler())
        };
        let examination = weights(build).samples(64).examine();
        found(&examination, "refusal", "").detail.clone()
    };
    assert_eq!(
        accepting(&|w| w.iter().any(|x| x.is_nan()), 0.5),
        "3 of 12 inputs break it. The first: the first entry is NaN: it is accepted"
    );
    assert_eq!(
        accepting(&|w| w.len() == 37 && w[18] == -1.0, 0.5),
        "one of 12 inputs breaks it. the middle entry is -1: it is accepted"
    );
    assert_eq!(
        accepting(&|w| w.len() == 37 && w[36] == f64::INFINITY, 0.5),
        "one of 12 inputs breaks it. the last entry is inf: it is accepted"
    );
    assert_eq!(
        accepting(&|w| w == [0.0; 37], 0.5),
        "one of 12 inputs breaks it. all entries are 0: it is accepted"
    );
    // A table of one entry is none of no weights.
    assert_eq!(accepting(&|w| w.is_empty(), 0.5), "holds for 12 inputs");
    // A sum that overflows is refused, or has masses like any other.
    let huge = |mass: f64| accepting(&|w| w == [1e38; 37], mass);
    assert_eq!(
        (huge(1.0 / 37.0), huge(0.999)),
        ("holds for 12 inputs".to_owned(), "holds for 12 inputs".to_owned())
    );
    for (mass, says) in [(0.0, "0"), (1.0, "1"), (f64::NAN, "NaN"), (-0.1, "-0.1")] {
        assert_eq!(
            huge(mass),
            format!("one of 12 inputs breaks it. entries of 1e38 each: the mass at index 0 is {says}")
        );
    }
}

/// Rows, columns, and the values of texels in the middle channel.
type Given = (usize, usize, Vec<f64>);

#[test]
fn maps_that_a_builder_is_given() {
    let given = RefCell::new(Vec::<Given>::new());
    let colours = RefCell::new(Vec::new());
    let build = |width: usize, height: usize, texels: Vec<[f32; 3]>| {
        given.borrow_mut().push((width, height, texels.iter().map(|t| f64::from(t[1])).collect()));
        colours
            .borrow_mut()
            .extend(texels.iter().copied().filter(|t| t[1].is_normal() && t[1] > 0.0 && t[1] < 1e37));
        Environment::new(width, height, texels, RowWarp::UniformCosTheta)
    };
    let examination = maps(build).samples(16).examine();
    let value = |column: usize, row: usize| 1.5 + (1.7 * column as f64).sin() + 0.3 * row as f64;
    let map = |width: usize, height: usize, of: &dyn Fn(usize, usize) -> f64| -> Given {
        (width, height, (0..width * height).map(|i| of(i % width, i / width)).collect())
    };
    let plain = map(12, 7, &value);
    let scaled = |factor: f64| map(12, 7, &|c, r| factor * value(c, r));
    let mut expected = vec![
        plain.clone(),
        map(12, 7, &|c, r| value(11 - c, r)),
        plain.clone(),
        map(12, 7, &|c, r| value((c + 11) % 12, r)),
        plain.clone(),
        map(12, 7, &|c, r| value((c + 7) % 12, r)),
        plain.clone(),
        map(24, 14, &|c, r| value(c / 2, r / 2)),
        plain.clone(),
        scaled(2.0_f64.powi(60)),
        plain.clone(),
        scaled(2.0_f64.powi(-60)),
    ];
    for (column, row) in [(0, 0), (11, 0), (0, 6), (11, 6), (6, 0), (6, 6), (6, 3), (0, 3), (11, 3)] {
        expected.push(map(12, 7, &|c, r| if (c, r) == (column, row) { 1e6 } else { 1.0 }));
    }
    let dark =
        |is: &dyn Fn(usize, usize) -> bool| map(12, 7, &|c, r| if is(c, r) { 0.0 } else { value(c, r) });
    expected.extend([
        dark(&|c, r| c == 0 || r == 0),
        dark(&|c, r| c == 11 || r == 6),
        dark(&|c, r| (c + r) % 2 == 0),
    ]);
    for at in [0, 41, 83] {
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            expected.push(map(12, 7, &|c, r| if r * 12 + c == at { bad } else { value(c, r) }));
        }
    }
    expected.extend([map(12, 7, &|_, _| 0.0), map(12, 7, &|_, _| 1e38)]);
    let given = given.into_inner();
    assert_eq!(given.len(), expected.len());
    for ((w, h, found), (width, height, expected)) in given.iter().zip(&expected) {
        assert_eq!((w, h), (width, height));
        let alike =
            |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * b.abs() || a.is_nan() && b.is_nan() || a == b;
        assert!(
            found.len() == expected.len() && found.iter().zip(expected).all(alike),
            "{found:?}, not {expected:?}"
        );
    }
    // The red of a texel has its value times its mantissa, in [1, 2), and red and blue are three times the green.
    for [r, g, b] in colours.into_inner() {
        let mantissa = g / g.log2().floor().exp2();
        assert!(
            (r / g - mantissa).abs() < 1e-4
                && (1.0..=2.0).contains(&(r / g))
                && ((r + b) / g - 3.0).abs() < 1e-5,
            "{r} {g} {b}"
        );
    }
    assert_eq!(examination.samples, 16 * 8 + 2 * 4096 + 9 * 16 + 3 * 4096);
    let expected = [
        ("scaling", "holds for 2 inputs"),
        ("mirror", "holds for 1 inputs"),
        ("rotation", "holds for 2 inputs"),
        ("refinement", "holds for 1 inputs"),
        ("bright entry", "holds for 9 inputs"),
        ("zero weights", "holds for 3 inputs"),
        ("refusal", "holds for 11 inputs"),
    ];
    assert_eq!(said(&examination), expected);
    assert_eq!((examination.name.as_str(), examination.domain), ("map", "sphere"));
}

/// A direction in the middle of a texel, or by these parts of it.
fn direction(width: usize, height: usize, texel: usize, [down, right]: [f64; 2]) -> DVec3 {
    let (theta, phi) = (
        PI * ((texel / width) as f64 + down) / height as f64,
        TAU * ((texel % width) as f64 + right) / width as f64,
    );
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// What is said of a relation where `leads` says where a sample of some map lies, and `density` by what it is multiplied in a texel.
fn spoiled_map(
    relation: &str,
    leads: impl Fn(&[f64], usize) -> Option<(usize, [f64; 2])> + Sync,
    factor: impl Fn(&[f64], usize, usize) -> f64 + Sync,
) -> String {
    let (leads, factor) = (&leads, &factor);
    let build = |width: usize, height: usize, texels: Vec<[f32; 3]>| {
        let values: Vec<f64> = texels.iter().map(|t| f64::from(t[1])).collect();
        // Only those that are asked about are built.
        let (bright, dark) = (values.contains(&1e6), values.contains(&0.0));
        if (bright, dark) != (relation == "bright entry", relation == "zero weights") {
            return Err("not now".to_owned());
        }
        let map =
            Environment::new(width, height, texels, RowWarp::UniformCosTheta).map_err(|e| e.to_string())?;
        let there = leads(&values, width);
        let own = map.clone();
        let texel = move |w: DVec3| {
            let phi = w.y.atan2(w.x).rem_euclid(TAU);
            let (row, column) = (
                (w.z.clamp(-1.0, 1.0).acos() / PI * height as f64) as usize,
                (phi / TAU * width as f64) as usize,
            );
            row.min(height - 1) * width + column.min(width - 1)
        };
        let sample = move |xi: [f64; 2]| match there {
            Some((t, part)) => direction(width, height, t, part),
            None => Sampler::sample(&own, &xi).unwrap().point,
        };
        Ok::<_, String>(from_fn(Sphere, sample, move |w: DVec3| {
            Sampler::density(&map, &w) * factor(&values, width, texel(w))
        }))
    };
    let examination = maps(build).samples(64).examine();
    found(&examination, relation, "").detail.clone()
}

fn is_refused(values: &[f64]) -> bool {
    !values.iter().all(|v| *v >= 0.0 && v.is_finite()) || values.iter().all(|v| *v == 0.0)
}

#[test]
fn masses_of_spoiled_maps() {
    let never = |_: &[f64], _: usize| None;
    // Texel 17, column 5 of row 1, is column 6 of the mirrored map, 18 in it; rotated by 5 it is column 10.
    let mirrored = |v: &[f64]| (v[11] - 1.5).abs() < 1e-6;
    let said =
        spoiled_map("mirror", never, |v, w, t| if w == 12 && mirrored(v) && t == 18 { 1.01 } else { 1.0 });
    assert!(
        said.starts_with(
            "one of 1 inputs breaks it. the map mirrored: entry 17 of an uneven 12 x 7 map had the mass "
        ),
        "{said}"
    );
    let rotated = |v: &[f64]| (v[5] - 1.5).abs() < 1e-6 && (v[6] - 2.491_66).abs() < 1e-4;
    let said =
        spoiled_map("rotation", never, |v, w, t| if w == 12 && rotated(v) && t == 22 { 1.01 } else { 1.0 });
    assert!(said.starts_with("one of 2 inputs breaks it. the map rotated by 5 columns: entry 17 of an uneven 12 x 7 map had the mass "), "{said}");
    let said =
        spoiled_map("refinement", never, |_, w, t| if w == 24 && t == 2 * 24 + 11 { 1.01 } else { 1.0 });
    assert!(
        said.starts_with(
            "one of 1 inputs breaks it. each texel in 2 x 2: entry 17 of an uneven 12 x 7 map had the mass "
        ),
        "{said}"
    );
    // Of a map that is told to be even: its solid angle over all, in row 1 of 7.
    let build = |width: usize, height: usize, texels: Vec<[f32; 3]>| {
        let values: Vec<f64> = texels.iter().map(|t| f64::from(t[1])).collect();
        let is_spoiled = (width, height) == (12, 7) && mirrored(&values);
        let is_18 = |w: DVec3| {
            w.z.acos() * 7.0 / PI < 2.0 && w.z.acos() * 7.0 / PI > 1.0 && {
                let column = w.y.atan2(w.x).rem_euclid(TAU) * 12.0 / TAU;
                (6.0..7.0).contains(&column)
            }
        };
        let factor = move |w: DVec3| if is_spoiled && is_18(w) { 1.5 } else { 1.0 };
        if is_refused(&values) {
            return Err("bad".to_owned());
        }
        Ok(from_fn(Sphere, |_: [f64; 2]| DVec3::Z, move |w: DVec3| factor(w) / (4.0 * PI)))
    };
    let examination = maps(build).samples(16).without("bright entry").examine();
    let said = &found(&examination, "mirror", "").detail;
    let number = |after: &str| -> f64 {
        said.split(after).nth(1).unwrap().split(',').next().unwrap().parse().unwrap()
    };
    let mass = ((PI / 7.0).cos() - (2.0 * PI / 7.0).cos()) / 24.0;
    near(number("map had the mass "), mass, 1e-6);
    near(number("here it has "), 1.5 * mass, 1e-6);
    let said = spoiled_map("scaling", never, |v, _, t| if v[0] < 1e-10 && t == 20 { 1.01 } else { 1.0 });
    assert!(
        said.starts_with(
            "one of 2 inputs breaks it. an uneven 12 x 7 map, times 2^-60: the density in entry 20 is "
        ),
        "{said}"
    );
}

/// By their place, and up to a rounding of their borders.
#[test]
fn bright_and_dark_texels_of_spoiled_maps() {
    let never = |_: &[f64], _: usize| None;
    let right = |_: &[f64], _: usize, _: usize| 1.0;
    let bright = |v: &[f64], at: usize| v.len() == 84 && v[at] == 1e6;
    for (at, place) in [
        (0, "left of the top row, at column 0, row 0"),
        (83, "right of the bottom row, at column 11, row 6"),
        (42, "middle, at column 6, row 3"),
        (78, "middle of the bottom row, at column 6, row 6"),
    ] {
        let said = spoiled_map("bright entry", |v, _| bright(v, at).then_some((5, [0.5; 2])), right);
        assert_eq!(
            said,
            format!(
                "one of 9 inputs breaks it. the bright entry is {place}: 0 of 64 samples lie there; most of them at column 5, row 0"
            )
        );
    }
    let said =
        spoiled_map("bright entry", never, |v, _, t| if bright(v, 42) && t == 42 { 1e-7 } else { 1.0 });
    assert!(said.starts_with("one of 9 inputs breaks it. the bright entry is middle, at column 6, row 3: the density is largest at column "), "{said}");
    // The chequered map: texel 41 is dark, in its middle and up to a rounding of its border.
    let chequered = |v: &[f64]| {
        v.len() == 84
            && v[0] == 0.0
            && v[1] > 0.0
            && v[41] == 0.0
            && v[13] == 0.0
            && v[24] == 0.0
            && v[12] > 0.0
    };
    let zero = |part: [f64; 2]| spoiled_map("zero weights", |v, _| chequered(v).then_some((41, part)), right);
    let said = zero([0.5; 2]);
    assert!(
        said.starts_with(
            "one of 3 inputs breaks it. a chequered map: xi = [0.0, 0.0] draws column 5, row 3, of weight 0"
        ),
        "{said}"
    );
    // The pole is the end of the last row.
    let last_row = |v: &[f64]| v.len() == 84 && v[83] == 0.0 && v[72] == 0.0 && v[1] > 0.0 && v[2] > 0.0;
    let said = spoiled_map("zero weights", |v, _| last_row(v).then_some((72, [1.0, 0.0])), right);
    let dark = "one of 3 inputs breaks it. a map with a dark last row and column: xi = [0.0, 0.0] draws column 0, row 6, of weight 0";
    assert_eq!(said, dark);
    // A texel is 0.449 high and 0.524 wide, at 90 degrees: 3e-6 are 6.7e-6 and 5.7e-6 of it.
    for (part, dark) in [(6.0e-6, false), (7.5e-6, true), (1.0 - 6.0e-6, false), (1.0 - 7.5e-6, true)] {
        assert_eq!(!zero([part, 0.5]).starts_with("holds"), dark, "{part} down");
    }
    for (part, dark) in [(5.0e-6, false), (7.0e-6, true), (1.0 - 5.0e-6, false), (1.0 - 7.0e-6, true)] {
        assert_eq!(!zero([0.5, part]).starts_with("holds"), dark, "{part} right");
    }
    let said = spoiled_map("zero weights", never, |v, _, t| if chequered(v) && t == 42 { 1.01 } else { 1.0 });
    assert!(said.starts_with("holds"), "{said}");
}

/// The ends and the middle of each variate, before others.
#[test]
fn ends_of_variates_come_first() {
    let asked = Mutex::new(Vec::new());
    fn record<const N: usize>(asked: &Mutex<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
        let build = |w: &[f64]| {
            let right = Table::new(w)?;
            let only_first = w[0] == 1.0 && w[36] == 0.0;
            let point = move |xi: [f64; N]| {
                if only_first {
                    asked.lock().unwrap().push(xi.to_vec());
                }
                0_usize
            };
            let mass = right.mass;
            Ok::<_, String>(from_fn(Discrete::new(mass.len()), point, move |i: usize| mass[i]))
        };
        weights(build).samples(1).examine();
        std::mem::take(&mut asked.lock().unwrap())
    }
    let ends = [0.0, 0.5, f64::from(ONE_MINUS_EPSILON_F32), ONE_MINUS_EPSILON_F64];
    let one = record::<1>(&asked);
    assert_eq!(one[..4], ends.map(|x| vec![x]));
    assert_eq!(one.len(), 4 + 4096);
    let two = record::<2>(&asked);
    assert_eq!(
        (two.len(), &two[1], &two[4], &two[15]),
        (16 + 4096, &vec![0.5, 0.0], &vec![0.0, 0.5], &vec![ends[3]; 2])
    );
    let five = record::<5>(&asked);
    assert_eq!(five.len(), 256 + 4096);
    assert_eq!(
        (&five[2], &five[64 * 3], &five[255]),
        (&vec![ends[2], 0.0, 0.0, 0.0, 0.0], &vec![0.0, 0.0, 0.0, ends[3], ends[3]], &vec![ends[3]; 5])
    );
}
