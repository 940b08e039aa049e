//! Which variates a sampler is asked at, and what is said of its answers there.

use super::*;
use std::sync::Mutex;
use warpcheck::domain::{Discrete, Interval};
use warpcheck::random::{ONE_MINUS_EPSILON_F32, ONE_MINUS_EPSILON_F64, fill_unit};
use warpcheck::statistics::{chi_square, poisson};
use warpcheck::verify::Verdict;

fn line() -> Interval {
    Interval::new(0.0, 1.0)
}

fn plain(xi: &[f64]) -> Option<Sample<f64>> {
    Some(Sample { point: xi[0], density: 1.0 })
}

/// By one check alone, of 1000 samples.
fn examined<D: Domain>(sampler: &Told<'_, D>, check: &str) -> Examination {
    alone(warpcheck::verify(sampler).samples(1000), check)
}

fn ends() -> [f64; 14] {
    let two = |e: i32| 2.0_f64.powi(e);
    [
        0.0,
        5e-324,
        two(-149),
        two(-53),
        two(-32),
        two(-24),
        0.25,
        0.5 - two(-25),
        0.5 - two(-54),
        0.5,
        0.5 + two(-53),
        1.0 - two(-11),
        1.0 - two(-24),
        1.0 - two(-53),
    ]
}

#[test]
fn ends_of_variates_and_their_knots() {
    assert_eq!((ends()[12], ends()[13]), (f64::from(ONE_MINUS_EPSILON_F32), ONE_MINUS_EPSILON_F64));
    let asked = |dimensions: usize, knots: Vec<f64>| {
        let all = Mutex::new(Vec::new());
        let sample = |xi: &[f64]| {
            all.lock().unwrap().push(xi.to_vec());
            (xi[0] != 0.25).then_some(Sample { point: xi[0], density: 1.0 })
        };
        let told = Told { dimensions, variate_knots: knots, ..Told::new(line(), sample, |_| 1.0) };
        let examination = examined(&told, "domain");
        let detail = found(&examination, "domain", "").detail.clone();
        drop(told);
        (all.into_inner().unwrap(), detail, examination.edges)
    };
    let (all, detail, _) = asked(2, vec![]);
    assert_eq!(detail, "points and densities are sound at 196 edge variates (14 rejected)");
    // The second runs slower, and they are asked one after another.
    let both: Vec<Vec<f64>> = ends().iter().flat_map(|&b| ends().map(|a| vec![a, b])).collect();
    assert!(all.windows(196).any(|run| run == both));
    // A knot, the steps beside it, and the other variate at its ends and in the middle.
    let (all, detail, _) = asked(2, vec![0.3, 1e-9]);
    assert_eq!(detail, "points and densities are sound at 244 edge variates (14 rejected)");
    let (single, step) = (0.3_f32, 2.0_f64.powi(-24));
    let near = [
        0.3,
        0.3_f64.next_down(),
        0.3_f64.next_up(),
        f64::from(single),
        f64::from(single.next_down()),
        f64::from(single.next_up()),
        0.3 - step,
        0.3 + step,
    ];
    let expected: Vec<Vec<f64>> =
        near.iter().flat_map(|&a| [0.0, 0.5, ONE_MINUS_EPSILON_F64].map(|b| vec![a, b])).collect();
    assert!(all.windows(24).any(|run| run == expected));
    assert!(all.contains(&vec![1e-9 + step, 0.5]) && !all.iter().flatten().any(|x| *x < 0.0));
    // Of five variates each alone, the others at a quarter.
    let (all, detail, edges) = asked(5, vec![]);
    assert_eq!(detail, "points and densities are sound at 70 edge variates (57 rejected)");
    let alone: Vec<Vec<f64>> = (0..5)
        .flat_map(|i| {
            ends().map(|a| {
                let mut xi = vec![0.25; 5];
                xi[i] = a;
                xi
            })
        })
        .collect();
    assert!(all.windows(70).any(|run| run == alone));
    // What people look at: each alone, the others in the middle.
    assert_eq!(edges.len(), 70);
    let probe = &edges[14 + 6];
    assert_eq!(
        (probe.variate, probe.value, probe.point.as_deref(), probe.density, probe.wrong.as_ref()),
        (1, 0.25, Some("0.500"), 1.0, None)
    );
    let rejected = &edges[6];
    assert!(
        rejected.point.is_none()
            && rejected.density.is_nan()
            && rejected.wrong.is_none()
            && rejected.variate == 0
    );
    let (_, detail, _) = asked(4, vec![]);
    assert_eq!(
        detail,
        format!(
            "points and densities are sound at {} edge variates ({} rejected)",
            14 * 14 * 14 * 14,
            14 * 14 * 14
        )
    );
}

#[test]
fn faults_at_the_end() {
    // A fault at the variate 2^-24 alone.
    let at = 2.0_f64.powi(-24);
    let said = |fault: &(dyn Fn(f64) -> Sample<f64> + Sync), asked: f64, left_over: f64| {
        let sample =
            |xi: &[f64]| Some(if xi[0] == at { fault(xi[0]) } else { Sample { point: xi[0], density: 1.0 } });
        let density = |x: &f64| if *x == at { asked } else { 1.0 };
        let rest = move |xi: &[f64]| if xi[0] == at { left_over } else { 0.5 };
        let told = Told { left_over: Some(Box::new(rest)), ..Told::new(line(), sample, density) };
        let examination = examined(&told, "domain");
        let finding = found(&examination, "domain", "");
        is_certain(
            finding,
            if finding.detail.starts_with("points and") { Verdict::Pass } else { Verdict::Fail },
        );
        let probes: Vec<_> = examination.edges.iter().filter_map(|e| e.wrong.clone()).collect();
        assert_eq!(
            probes,
            if finding.detail.starts_with("points and") { vec![] } else { vec![finding.detail.clone()] }
        );
        finding.detail.clone()
    };
    let fine = |xi: f64| Sample { point: xi, density: 1.0 };
    let dense = |density: f64| move |point: f64| Sample { point, density };
    let xi = format!("at xi = {:?} ", [at]);
    assert_eq!(
        said(&|_| Sample { point: 1.25, density: 1.0 }, 1.0, 0.5),
        format!("{xi}the point 1.250 is 1.25, outside of [0, 1]")
    );
    assert_eq!(said(&dense(-1.0), 1.0, 0.5), format!("{xi}the density returned at {at:.2e} is -1"));
    assert_eq!(said(&dense(f64::INFINITY), 1.0, 0.5), format!("{xi}the density returned at {at:.2e} is inf"));
    assert_eq!(said(&dense(f64::NAN), 1.0, 0.5), format!("{xi}the density returned at {at:.2e} is NaN"));
    assert_eq!(said(&fine, -0.5, 0.5), format!("{xi}the density asked at {at:.2e} is -0.5"));
    assert_eq!(said(&fine, 1.0, 1.0), format!("{xi}the variate left over is 1, outside of [0, 1)"));
    assert_eq!(said(&fine, 1.0, -0.1), format!("{xi}the variate left over is -0.1, outside of [0, 1)"));
    // On a rim a density may be 0.
    let sound = "points and densities are sound at 14 edge variates (0 rejected)";
    assert_eq!([said(&dense(0.0), 1.0, 0.5), said(&fine, 0.0, 0.0), said(&fine, 1.0, 0.999)], [sound; 3]);
    // An entry may not.
    let entry = |returned: f64, asked: f64| {
        let sample = |xi: &[f64]| {
            Some(if xi[0] == 0.0 {
                Sample { point: 1, density: returned }
            } else {
                Sample { point: 0, density: 1.0 }
            })
        };
        let told = Told::new(Discrete::new(2), sample, |&i| if i == 1 { asked } else { 1.0 });
        found(&examined(&told, "domain"), "domain", "").detail.clone()
    };
    let without_mass = "at xi = [0.0] it returns 1, whose mass is 0";
    assert_eq!(
        (entry(0.0, 0.1).as_str(), entry(0.1, 0.0).as_str(), entry(0.1, 0.1).as_str()),
        (without_mass, without_mass, sound)
    );
}

/// The variates that come back or don't, ascending.
fn round_trips() -> Vec<f64> {
    let mut drawn = vec![0.0; 1024];
    fill_unit(&mut stream(1, "round trip", 0), &mut drawn);
    drawn.sort_by(f64::total_cmp);
    drawn
}

fn judge(told: &Told<'_, Interval>) -> Finding {
    let examination = examined(told, "round trip");
    let finding = found(&examination, "round trip", "").clone();
    is_certain(&finding, if finding.detail.contains("don't") { Verdict::Fail } else { Verdict::Pass });
    finding
}

/// Of 1024 variates; one in 200 may sit on a border between branches.
#[test]
fn inverses_that_are_off() {
    let drawn = round_trips();
    let with = |invert: &(dyn Fn(f64) -> Vec<f64> + Sync)| {
        let told = Told { invert: Some(Box::new(|x: &f64| invert(*x))), ..Told::new(line(), plain, |_| 1.0) };
        judge(&told).detail
    };
    let off = |wrong: usize, by: f64| with(&|x| vec![if x < drawn[wrong] { x + by } else { x }]);
    assert_eq!(off(0, 0.1), "1024 of 1024 samples come back through the inverse");
    assert_eq!(off(5, 0.1), "1019 of 1024 samples come back through the inverse");
    let first = |wrong: usize| {
        let mut xi = [0.0];
        let mut rng = stream(1, "round trip", 0);
        loop {
            fill_unit(&mut rng, &mut xi);
            if xi[0] < drawn[wrong] {
                return xi[0];
            }
        }
    };
    let x = first(6);
    assert_eq!(
        off(6, 0.1),
        format!(
            "6 of 1024 samples don't come back; the first: xi = {:?} gives {}, whose inverse is {:?}",
            [x],
            short(x),
            [x + 0.1]
        )
    );
    // A thousandth is near.
    assert!(
        off(1024 - 1, 0.999e-3).starts_with("1024 of")
            && off(1024 - 1, 1.001e-3).starts_with("1023 of 1024 samples don't")
    );
    // What is no variate is none, even if near.
    assert!(with(&|x| vec![x.max(-0.5) - if x < 1e-3 { 0.9e-3 } else { 0.0 }]).starts_with("102"));
    assert_eq!(with(&|x| vec![x, 0.5]).split(" sam").next(), Some("1024 of 1024"));
    assert!(
        with(&|x| vec![x, 0.5]).contains("don't come back")
            && with(&|_| vec![]).contains("don't come back")
            && with(&|_| vec![f64::NAN]).contains("don't")
    );
    let sees =
        judge(&Told { invert: Some(Box::new(|x: &f64| vec![*x])), ..Told::new(line(), plain, |_| 1.0) }).sees;
    assert_eq!(sees, "a wrong inverse over 1.5% of the variates");
}

/// Where variates are squeezed together, the point must come back: to 4 millionths, or of a domain of measure 10 to 40.
#[test]
fn inverses_of_squeezed_variates() {
    let squeezed = |length: f64, within: f64, dimensions: usize| {
        let sample = move |xi: &[f64]| Some(Sample { point: within * xi[0], density: 1.0 });
        let told = Told {
            dimensions,
            invert: Some(Box::new(move |_: &f64| vec![0.0; dimensions])),
            ..Told::new(Interval::new(0.0, length), sample, |_| 1.0)
        };
        judge(&told).detail
    };
    assert!(
        squeezed(0.1, 3.99e-6, 1).starts_with("1024 of")
            && squeezed(1.0, 3.99e-6, 2).contains("come back through")
    );
    assert!(
        squeezed(1.0, 4.2e-6, 1).contains("don't")
            && squeezed(10.0, 3.99e-5, 1).starts_with("1024 of")
            && squeezed(10.0, 4.2e-5, 1).contains("don't")
    );
}

/// A variate that the point doesn't tell may come back as anything in [0, 1], up to a millionth.
#[test]
fn inverses_at_the_end() {
    let with = |second: f64| {
        let told = Told {
            dimensions: 2,
            invert: Some(Box::new(move |x: &f64| vec![*x, second])),
            ..Told::new(line(), plain, |_| 1.0)
        };
        judge(&told).detail
    };
    assert!([0.0, 1.0, -0.9e-6, 1.0 + 0.9e-6].iter().all(|&x| with(x).contains("come back through")));
    assert!([-1.1e-6, 1.0 + 1.1e-6].iter().all(|&x| with(x).contains("don't come back")));
}

/// Entries come back or don't; samples that are rejected, and points without an inverse, are not asked.
#[test]
fn inverses_of_entries() {
    let drawn = round_trips();
    let entries = |inverse: f64| {
        let sample =
            |xi: &[f64]| (xi[0] < 0.75).then_some(Sample { point: usize::from(xi[0] >= 0.5), density: 0.5 });
        let told = Told {
            invert: Some(Box::new(move |&i: &usize| vec![inverse + 0.5 * i as f64])),
            ..Told::new(Discrete::new(2), sample, |_| 0.5)
        };
        found(&examined(&told, "round trip"), "round trip", "").detail.clone()
    };
    let asked = drawn.iter().filter(|&&x| x < 0.75).count();
    assert_eq!(entries(0.1), format!("{asked} of {asked} samples come back through the inverse"));
    assert!(entries(0.45).contains("don't come back"));
    assert!(examined(&Told::new(line(), plain, |_| 1.0), "round trip").findings.is_empty());
}

/// Equal points among 2^14, and how many there may be.
#[test]
fn repeats_by_hand() {
    const N: usize = 1 << 14;
    let mut xi = vec![0.0; N];
    fill_unit(&mut stream(1, "repeats", 0), &mut xi);
    let pairs = 0.5 * N as f64 * (N as f64 - 1.0);
    let rounded = |steps: f64| move |x: f64| (x * steps).floor() / steps;
    let judge = |length: f64, density: f64, steps: f64| {
        let round = rounded(steps);
        let sample = |xi: &[f64]| Some(Sample { point: length * round(xi[0]), density });
        let examination =
            examined(&Told::new(Interval::new(0.0, length), sample, |_| 1.0 / length), "repeats");
        let mut values: Vec<u64> = xi.iter().map(|&x| (steps * round(x)).round() as u64).collect();
        values.sort();
        let equal: u64 =
            values.chunk_by(|a, b| a == b).map(|run| run.len() as u64 * (run.len() as u64 - 1) / 2).sum();
        // A rounding cell of a point as large as the domain, or of 1, has so much of the mass; variates are on a lattice of 2^24.
        let mean = pairs * ((2.4e-7 * length.max(1.0) * density).min(1.0) + 2.0_f64.powi(-24));
        let finding = found(&examination, "repeats", "");
        let distinct = if equal > 0 {
            format!(", as if there were {:.0} values", pairs / equal as f64)
        } else {
            String::new()
        };
        assert_eq!(
            finding.detail,
            format!("{equal} pairs of 16384 samples are equal to the last bit, {mean:.1} may be{distinct}")
        );
        near(p_of(finding).0, if equal == 0 { 1.0 } else { poisson::upper_tail(equal, mean).unwrap() }, 1e-9);
        assert_eq!(
            finding.sees,
            format!("fewer than {:.0} distinct values", pairs / (mean + 5.0 * mean.sqrt() + 20.0))
        );
        equal
    };
    assert_eq!(judge(1.0, 1.0, 1e15), 0);
    assert!(judge(1.0, 1.0, 4.0e6) > 10 && judge(1.0, 1.0, 1e3) > 1000);
    judge(8.0, 0.125, 4.0e6);
    judge(0.25, 4.0, 4.0e6);
    judge(1.0, 1e9, 1e15);
    // Rejected samples, and those without a density, are none; entries say nothing by being equal.
    let some = |kept: f64, density: f64| {
        let sample = |xi: &[f64]| {
            if xi[0] < 0.5 {
                None
            } else {
                Some(Sample {
                    point: (xi[0] * 500.0).floor() / 500.0,
                    density: if xi[0] < kept { 2.0 } else { density },
                })
            }
        };
        examined(&Told::new(line(), sample, |_| 2.0), "repeats").findings
    };
    let half = xi.iter().filter(|&&x| x >= 0.5).count();
    assert!(some(1.0, 2.0)[0].detail.contains(&format!("of {half} samples")));
    let less = xi.iter().filter(|&&x| (0.5..0.75).contains(&x)).count();
    assert!(some(0.75, f64::NAN)[0].detail.contains(&format!("of {less} samples")));
    let mut last: Vec<f64> = xi.iter().copied().filter(|&x| x >= 0.5).collect();
    last.sort_by(f64::total_cmp);
    assert!(some(last[1], f64::INFINITY).is_empty());
    assert!(some(last[2], f64::INFINITY)[0].detail.contains("of 2 samples"));
    let entry = Told::new(
        Discrete::new(2),
        |xi: &[f64]| Some(Sample { point: usize::from(xi[0] < 0.5), density: 0.5 }),
        |_| 0.5,
    );
    assert!(examined(&entry, "repeats").findings.is_empty());
}

/// Three entries and rejected samples, and what is left over of the variate: every table is counted again here.
#[test]
fn independence_by_hand() {
    const SAMPLES: usize = 20_000;
    let class = |xi: f64| {
        if xi < 0.2 {
            0
        } else if xi < 0.5 {
            1
        } else if xi < 0.9 {
            2
        } else {
            3
        }
    };
    let starts = [0.0, 0.2, 0.5, 0.9, 1.0];
    let sample = |xi: &[f64]| {
        (class(xi[0]) < 3).then(|| Sample { point: class(xi[0]), density: [0.2, 0.3, 0.4][class(xi[0])] })
    };
    let rest = |xi: f64| {
        let c = class(xi);
        (((xi - starts[c]) / (starts[c + 1] - starts[c])) as f32).next_down().max(0.0).into()
    };
    let told = Told {
        left_over: Some(Box::new(move |xi: &[f64]| rest(xi[0]))),
        ..Told::new(Discrete::new(3), sample, |&i| [0.2, 0.3, 0.4][i])
    };
    let examination = alone(warpcheck::verify(&told).samples(SAMPLES as u64).seed(8), "independence");
    let drawn = |purpose: &str, shard: u64, count: usize| {
        let mut xi = vec![0.0; count];
        fill_unit(&mut stream(8, purpose, shard), &mut xi);
        xi
    };
    let shards = [drawn("verify", 0, 1 << 14), drawn("verify", 1, SAMPLES - (1 << 14))];
    let test = |counts: Vec<u64>, columns: usize, part: &str| {
        let figure = chi_square::independence(&counts, columns).unwrap();
        let finding = found(&examination, "independence", part);
        assert_eq!(
            finding.detail,
            format!("X^2 = {:.1} at {} degrees of freedom", figure.statistic, figure.df)
        );
        near(p_of(finding).0, figure.p, 1e-9);
    };
    let mut pairs = vec![0; 16];
    shards.iter().flat_map(|s| s.windows(2)).for_each(|w| pairs[class(w[0]) * 4 + class(w[1])] += 1);
    test(pairs, 4, "consecutive samples");
    let mut streams = vec![0; 16];
    drawn("two streams", 0, 1 << 14)
        .into_iter()
        .zip(drawn("two streams", 1, 1 << 14))
        .for_each(|(a, b)| streams[class(a) * 4 + class(b)] += 1);
    test(streams, 4, "two streams");
    let mut left_over = vec![0; 48];
    let all = || shards.iter().flatten().filter(|&&xi| class(xi) < 3);
    all().for_each(|&xi| left_over[class(xi) * 16 + (16.0 * rest(xi)) as usize] += 1);
    test(left_over.clone(), 16, "point and variate left over");
    let sixteenths: Vec<u64> = (0..16).map(|i| left_over.iter().skip(i).step_by(16).sum()).collect();
    let expected = all().count() as f64 / 16.0;
    let x2: f64 = sixteenths.iter().map(|&o| (o as f64 - expected).powi(2) / expected).sum();
    let finding = found(&examination, "independence", "variate left over");
    assert_eq!(
        finding.detail,
        format!("X^2 = {x2:.1} at 15 degrees of freedom: is the variate left over uniform?")
    );
    near(p_of(finding).0, chi_square::sf(x2, 15.0).unwrap(), 1e-9);
    assert_eq!(examination.findings.len(), 4);
    // Of few samples too few are left over for that: 8 to each sixteenth.
    let few = |samples: u64| {
        let told = Told {
            left_over: Some(Box::new(|xi: &[f64]| (2.0 * xi[0]).fract())),
            ..Told::new(
                Discrete::new(2),
                |xi: &[f64]| Some(Sample { point: usize::from(xi[0] >= 0.5), density: 0.5 }),
                |_| 0.5,
            )
        };
        let examination = alone(warpcheck::verify(&told).samples(samples), "independence");
        examination.findings.iter().any(|f| f.part == "variate left over")
    };
    assert!(few(128) && !few(127));
}

/// Classes of which so few are expected that a pair of them has less than two samples are left out, the lightest first.
#[test]
fn light_classes_are_left_out() {
    const SAMPLES: usize = 10_000;
    let borders = [0.01, 0.498, 0.5, 1.0];
    let class = |xi: f64| borders.iter().position(|&b| xi < b).unwrap();
    let masses = [0.01, 0.488, 0.002, 0.5];
    let sample = |xi: &[f64]| Some(Sample { point: class(xi[0]), density: masses[class(xi[0])] });
    let told = Told::new(Discrete::new(4), sample, |&i| masses[i]);
    let examination = alone(warpcheck::verify(&told).samples(SAMPLES as u64), "independence");
    let mut xi = vec![0.0; SAMPLES];
    fill_unit(&mut stream(1, "verify", 0), &mut xi);
    // About 20 of entry 2 and 100 of entry 0: too light for themselves and each other, but not for the 4,880 of entry 1.
    let mut pairs = vec![0_u64; 16];
    xi.windows(2).for_each(|w| pairs[class(w[0]) * 4 + class(w[1])] += 1);
    let figure = without_light_classes(pairs, 4);
    assert!(figure.df < 9.0);
    let finding = found(&examination, "independence", "consecutive samples");
    assert_eq!(finding.detail, format!("X^2 = {:.1} at {} degrees of freedom", figure.statistic, figure.df));
}

/// The lightest row or column is left out until every cell expects two.
fn without_light_classes(mut pairs: Vec<u64>, classes: usize) -> chi_square::Figure {
    loop {
        let row = |r: usize| pairs[classes * r..][..classes].iter().sum::<u64>();
        let column = |c: usize| (0..classes).map(|r| pairs[classes * r + c]).sum::<u64>();
        let (r, a) = (0..classes).map(|r| (r, row(r))).filter(|r| r.1 > 0).min_by_key(|r| r.1).unwrap();
        let (c, b) = (0..classes).map(|c| (c, column(c))).filter(|c| c.1 > 0).min_by_key(|c| c.1).unwrap();
        if a * b >= 2 * pairs.iter().sum::<u64>() {
            return chi_square::independence(&pairs, classes).unwrap();
        }
        (0..classes).for_each(|i| pairs[if a <= b { classes * r + i } else { classes * i + c }] = 0);
    }
}

/// Entries that are too light for a cell are of the class of all that has none.
#[test]
fn light_entries_of_two_streams() {
    // Of 10,000 samples entry 1 expects five, between two that no cell has room for beside it.
    let (borders, masses) = ([0.4995, 0.5, 1.0], [0.4995, 0.0005, 0.5]);
    let entry = |xi: f64| borders.iter().position(|&b| xi < b).unwrap();
    let class = |xi: f64| [0, 2, 1][entry(xi)];
    let sample = |xi: &[f64]| Some(Sample { point: entry(xi[0]), density: masses[entry(xi[0])] });
    let told = Told::new(Discrete::new(3), sample, |&i| masses[i]);
    let examination = alone(warpcheck::verify(&told).samples(10_000), "independence");
    let streams = [0, 1].map(|number| {
        let mut xi = vec![0.0; 1 << 14];
        fill_unit(&mut stream(1, "two streams", number), &mut xi);
        xi
    });
    let mut pairs = vec![0_u64; 9];
    streams[0].iter().zip(&streams[1]).for_each(|(&a, &b)| pairs[class(a) * 3 + class(b)] += 1);
    assert!((1..100).contains(&pairs[6..].iter().sum::<u64>()));
    let figure = without_light_classes(pairs, 3);
    let finding = found(&examination, "independence", "two streams");
    assert_eq!(finding.detail, format!("X^2 = {:.1} at {} degrees of freedom", figure.statistic, figure.df));
}

/// How many samples are looked at for bad ones.
const COUNTED: usize = 20_000;

fn is_bad(x: f64) -> bool {
    (0.3..0.3004).contains(&x)
}

/// How many samples are bad, and the first of them; drawn again here.
fn bad_ones() -> (usize, f64) {
    let mut xi = vec![0.0; COUNTED];
    fill_unit(&mut stream(1, "verify", 0), &mut xi[..1 << 14]);
    fill_unit(&mut stream(1, "verify", 1), &mut xi[1 << 14..]);
    let bad: Vec<f64> = xi.into_iter().filter(|&x| is_bad(x)).collect();
    (bad.len(), bad[0])
}

/// What a check says where bad samples are as told, and so are the densities asked and what is left over; and how many were rejected.
fn counted(
    check: &str,
    fault: impl Fn(f64) -> Option<Sample<f64>> + Sync,
    asked: impl Fn(f64) -> f64 + Sync,
    rest: impl Fn(f64) -> f64 + Sync,
) -> (String, u64) {
    let sample = |xi: &[f64]| if is_bad(xi[0]) { fault(xi[0]) } else { plain(xi) };
    let told = Told {
        left_over: Some(Box::new(|xi: &[f64]| rest(xi[0]))),
        ..Told::new(line(), sample, |&x| asked(x))
    };
    let examination = alone(warpcheck::verify(&told).samples(COUNTED as u64), check);
    (found(&examination, check, "").detail.clone(), examination.rejected)
}

fn one(_: f64) -> f64 {
    1.0
}

fn half(_: f64) -> f64 {
    0.5
}

fn fine(x: f64) -> Option<Sample<f64>> {
    plain(&[x])
}

/// A coordinate as messages have it: three digits behind the point, or three in all.
fn short(x: f64) -> String {
    if x < 0.01 { format!("{x:.2e}") } else { format!("{x:.3}") }
}

fn dense(density: f64) -> impl Fn(f64) -> Option<Sample<f64>> {
    move |point: f64| Some(Sample { point, density })
}

#[test]
fn impossible_samples_are_counted() {
    let (count, first) = bad_ones();
    assert!(count > 1);
    let of = |what: &str, why: String| {
        format!("{count} of {COUNTED} samples {what}; the first: {why} (xi = {:?})", [first])
    };
    let all = format!("all {COUNTED} samples lie where the density is positive");
    assert_eq!(counted("support", fine, one, half).0, all);
    let beyond = counted("support", |x| Some(Sample { point: x + 1.0, density: 1.0 }), one, half).0;
    let why = format!("the point {:.3} is {}, outside of [0, 1]", first + 1.0, first + 1.0);
    assert_eq!(beyond, of("are outside of the domain", why));
    for density in [f64::NAN, -1.0] {
        let said = counted("support", dense(density), one, half).0;
        let why = format!("the density at {first:.3} is {density}");
        assert_eq!(said, of("have an impossible density", why));
    }
    let infinite = counted("support", fine, |x| if is_bad(x) { f64::INFINITY } else { 1.0 }, half).0;
    let why = format!("asked for the density at {first:.3}, it says inf");
    assert_eq!(infinite, of("have an impossible density", why));
    let rest = counted("support", fine, one, |x| if is_bad(x) { 1.0 } else { 0.0 }).0;
    assert_eq!(rest, of("leave over a variate outside of [0, 1)", "the variate left over is 1".to_owned()));
}

#[test]
fn samples_without_density_are_counted() {
    let (count, first) = bad_ones();
    let on_border = counted("support", dense(0.0), one, half).0;
    let all = format!("all {COUNTED} samples lie where the density is positive");
    let too_many = "have the density 0 on a border: too many for rounding";
    assert_eq!(on_border, format!("{all}, but {count} of them {too_many}"));
    let nowhere = |x: f64| if (0.299_998..0.300_402).contains(&x) { 0.0 } else { 1.0 };
    let said = counted("support", dense(0.0), nowhere, half).0;
    let where_it_is = format!("{count} of {COUNTED} samples are where the density is 0; the first: ");
    assert_eq!(said, format!("{where_it_is}the density at {first:.3} is 0 (xi = {:?})", [first]));
    let asked = counted("support", fine, |x| if is_bad(x) { 0.0 } else { 1.0 }, half).0;
    assert!(asked.starts_with(&format!("{where_it_is}asked, the density at {first:.3} is 0")), "{asked}");
}

/// The first bad sample is told with all of its variates.
#[test]
fn samples_are_called_by_both_variates() {
    let outside = |xi: &[f64]| xi[0] > 0.9 && xi[1] < 0.1;
    let sample = move |xi: &[f64]| {
        let point = glam::DVec2::new(if outside(xi) { 1.5 } else { xi[0] }, xi[1]);
        Some(Sample { point, density: 1.0 })
    };
    let told = Told { dimensions: 2, ..Told::new(warpcheck::domain::Square, sample, |_| 1.0) };
    let examination = alone(warpcheck::verify(&told).samples(2000), "support");
    let mut xi = vec![0.0; 4000];
    fill_unit(&mut stream(1, "verify", 0), &mut xi);
    let first = xi.chunks_exact(2).position(outside).unwrap();
    assert!(first > 0);
    let detail = &found(&examination, "support", "").detail;
    assert!(detail.ends_with(&format!(" (xi = {:?})", &xi[2 * first..][..2])), "{detail}");
}

/// On a short line densities are large, and a factor of two is one of two.
#[test]
fn large_densities_that_differ_are_counted() {
    let sample = |xi: &[f64]| Some(Sample { point: 1e-6 * xi[0], density: 2e6 });
    let told = Told::new(Interval::new(0.0, 1e-6), sample, |_| 1e6);
    let examination = alone(warpcheck::verify(&told).samples(1000), "agreement");
    let finding = found(&examination, "agreement", "");
    is_certain(finding, Verdict::Fail);
    let counted = "the density returned differs from the density asked for 1000 of 1000 samples, at worst by a factor of 1 + 1.00e0";
    assert!(finding.detail.starts_with(counted), "{}", finding.detail);
}

/// The densities of the point's neighbours explain what a rounding may do, twice over.
#[test]
fn densities_that_differ_are_counted() {
    let (count, first) = bad_ones();
    let (none, rejected) = counted("agreement", |_| None, one, half);
    let asked = COUNTED - count;
    assert!(none.ends_with(&format!("for all {asked} samples asked")) && rejected == count as u64, "{none}");
    let steep = |slope: f64, off: f64| {
        let density = move |x: f64| 1.0 + slope * (x - 0.3);
        let fault = move |x: f64| Some(Sample { point: x, density: density(x) + off });
        counted("agreement", fault, move |x| if is_bad(x) { density(x) } else { 1.0 }, half).0
    };
    let is_right = |said: String| said.starts_with("the density returned is the density asked");
    let differs =
        format!("the density returned differs from the density asked for {count} of {COUNTED} samples");
    let how = "at worst by a factor of 1 + 1.00e-2: 1.01e0 came with the point";
    let where_it_is = format!("{first:.3}, where asking gives 1e0 (xi = {:?})", [first]);
    assert_eq!(steep(0.0, 0.01), format!("{differs}, {how} {where_it_is}"));
    // A slope of 1000 makes 2.5e-4 of a rounding of 2.5e-7, to either side, and the spread of both is allowed for once more.
    assert!(is_right(steep(0.0, 0.99e-4)) && is_right(steep(1000.0, 7e-4)) && is_right(steep(1000.0, -6e-4)));
    assert!(!is_right(steep(1000.0, 9e-4)) && !is_right(steep(1000.0, -9e-4)));
}

/// Later than the fourth shard, only each sixteenth sample is asked for its density again.
#[test]
fn later_samples_are_asked_rarely() {
    let examination = |samples: u64, slow: bool| {
        let told = Told { is_slow: slow, ..Told::new(line(), plain, |_| 1.0) };
        let examination = alone(warpcheck::verify(&told).samples(samples), "agreement");
        found(&examination, "agreement", "").detail.clone()
    };
    for slow in [false, true] {
        assert!(examination(4 << 14, slow).ends_with("for all 65536 samples asked"));
        assert!(
            examination((5 << 14) + 40, slow)
                .ends_with(&format!("for all {} samples asked", 65_536 + 1024 + 3))
        );
    }
}
