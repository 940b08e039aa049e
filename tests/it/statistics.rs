//! The statistics against tables of many digits (`data/oracle`, made by `scripts/oracle_statistics.py`), against closed
//! forms, and against laws that must hold for any input.

mod e_process;
mod grouped;
mod mean;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand_distr::{Binomial, Distribution};
use warpcheck::statistics::welch::{Summary, welch_t_test};
use warpcheck::statistics::{
    CompensatedSum, Error, Moments, anderson_darling, beta, binomial, chi_square, gamma, kolmogorov,
    multiplicity, normal, poisson, student_t,
};

/// Counts of `n` samples of known cell masses, cell after cell.
fn multinomial(n: u64, p: &[f64], rng: &mut impl Rng) -> Vec<u64> {
    let (mut left, mut mass) = (n, 1.0);
    p.iter()
        .map(|&p| {
            let share = if mass > p { p / mass } else { 1.0 };
            let count = Binomial::new(left, share).unwrap().sample(rng);
            left -= count;
            mass -= p;
            count
        })
        .collect()
}

/// The rows of a table, as numbers.
fn table(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/data/oracle/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert!(rows.len() > 10, "{path} has only {} rows", rows.len());
    rows
}

/// The largest relative error over a table, with the row where it occurs. Values below 1e-300 need only be as small.
#[derive(Default)]
struct Worst {
    error: f64,
    at: String,
}

impl Worst {
    fn relative(&mut self, got: f64, truth: f64, at: impl std::fmt::Debug) {
        if truth.abs() < 1e-300 {
            assert!(got.abs() < 1.001e-300, "{got} should be {truth} at {at:?}");
        } else {
            self.absolute(got / truth, 1.0, (at, got, truth));
        }
    }

    fn absolute(&mut self, got: f64, truth: f64, at: impl std::fmt::Debug) {
        let error = (got - truth).abs();
        if error.is_nan() || error > self.error {
            *self = Self { error, at: format!("{at:?}") };
        }
    }

    #[track_caller]
    fn below(self, tolerance: f64) {
        println!("largest error {:.2e} at {}", self.error, self.at);
        assert!(
            self.error < tolerance,
            "error {:e}, but at most {tolerance:e} is promised: {}",
            self.error,
            self.at
        );
    }
}

#[test]
fn normal_matches_the_table() {
    let (mut sf, mut ln_sf, mut isf) = (Worst::default(), Worst::default(), Worst::default());
    for row in table("normal") {
        sf.relative(normal::sf(row[0]), row[1], &row);
        ln_sf.relative(normal::ln_sf(row[0]), row[2], &row);
        if row[1] > 0.0 && row[0] > -3.5 {
            isf.absolute(normal::isf(row[1]).unwrap(), row[0], &row);
        }
    }
    sf.below(1e-13);
    ln_sf.below(1e-13);
    isf.below(1e-13);
}

#[test]
fn chi_square_matches_the_table() {
    let (mut tails, mut logs, mut inverse) = (Worst::default(), Worst::default(), Worst::default());
    for row in table("chi_square") {
        let (df, x) = (row[0], row[1]);
        tails.relative(chi_square::sf(x, df).unwrap(), row[2], &row);
        tails.relative(chi_square::cdf(x, df).unwrap(), row[3], &row);
        if row[2] > 1e-300 && row[2] < 0.9 {
            logs.absolute(chi_square::ln_sf(x, df).unwrap(), row[2].ln(), &row);
            inverse.relative(chi_square::isf(row[2], df).unwrap(), x, &row);
        }
    }
    tails.below(2e-12);
    logs.below(2e-12);
    inverse.below(1e-12);
}

#[test]
fn noncentral_chi_square_matches_the_table() {
    let mut worst = Worst::default();
    for row in table("noncentral_chi_square") {
        worst.absolute(chi_square::noncentral_sf(row[2], row[0], row[1]).unwrap(), row[3], &row);
        worst.absolute(chi_square::noncentral_cdf(row[2], row[0], row[1]).unwrap(), row[4], &row);
    }
    worst.below(1e-11);
}

#[test]
fn noncentral_chi_square_is_continuous_where_the_normal_form_takes_over() {
    for (df, lambda) in [(1e6_f64, 1e12_f64), (1.0, 1e12), (1e12, 1e6), (5e11, 5e11)] {
        let sd = (2.0 * (df + 2.0 * lambda)).sqrt();
        for z in [-3.0, -1.0, 0.0, 1.0, 3.0] {
            let x = df + lambda + z * sd;
            let below = chi_square::noncentral_sf(x - 2.0, df, lambda - 1.0).unwrap();
            let above = chi_square::noncentral_sf(x + 2.0, df, lambda + 1.0).unwrap();
            assert!((below - above).abs() < 1e-6, "{below} {above} at {df} {lambda} {z}");
        }
    }
}

#[test]
fn noncentral_chi_square_of_huge_parameters_is_normal_but_for_its_skewness() {
    // Edgeworth's first term; the next is of order 1e-12. Cumulants 2 (df + 2 lambda) and 8 (df + 3 lambda).
    for (df, lambda) in [(2e12_f64, 0.0_f64), (1.0, 2e12), (1e12, 3e12), (5e12, 1e12)] {
        let (mean, sd) = (df + lambda, (2.0 * (df + 2.0 * lambda)).sqrt());
        let skewness = 8.0 * (df + 3.0 * lambda) / sd.powi(3);
        for z in [-3.0, -1.0, 0.0, 1.0, 3.0] {
            let x = mean + z * sd;
            let z = (x - mean) / sd;
            let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            let truth = normal::sf(z) + skewness / 6.0 * (z * z - 1.0) * density;
            let got = chi_square::noncentral_sf(x, df, lambda).unwrap();
            assert!((got - truth).abs() < 1e-9, "{got} {truth} at {df} {lambda} {z}");
            let lower = chi_square::noncentral_cdf(x, df, lambda).unwrap();
            assert!((got + lower - 1.0).abs() < 1e-12, "{got} {lower} at {df} {lambda} {z}");
        }
    }
    for bad in [-1.0, f64::INFINITY, f64::NAN] {
        assert!(chi_square::noncentral_sf(1.0, bad, 1.0).is_err(), "{bad}");
        assert!(chi_square::noncentral_sf(1.0, 1.0, bad).is_err(), "{bad}");
    }
    assert!(chi_square::noncentral_sf(1.0, 0.0, 1.0).is_err());
    // r = sqrt(lambda (1 - mass) / (N mass)).
    assert!((chi_square::detectable_relative_error(4.0, 100, 0.2).unwrap() - 0.4).abs() < 1e-15);
    assert_eq!(chi_square::detectable_relative_error(0.0, 100, 0.2), Ok(0.0));
    for (lambda, samples) in [(-1.0, 100), (f64::INFINITY, 100), (f64::NAN, 100), (4.0, 0)] {
        assert!(chi_square::detectable_relative_error(lambda, samples, 0.2).is_err(), "{lambda} {samples}");
    }
    assert!(chi_square::noncentral_sf(f64::NAN, 1.0, 1.0).is_err());
}

#[test]
fn power_is_what_the_noncentrality_was_asked_for() {
    for df in [1.0, 9.0, 1000.0, 1e6] {
        for (alpha, power) in [(0.05, 0.5), (1e-4, 0.99), (1e-9, 0.999), (0.01, 0.011)] {
            let lambda = chi_square::noncentrality_for_power(alpha, df, power).unwrap();
            let reached = chi_square::noncentral_sf(chi_square::isf(alpha, df).unwrap(), df, lambda).unwrap();
            assert!((reached - power).abs() < 1e-9, "{reached} at {alpha} {df} {power}");
        }
    }
    // One degree of freedom has a closed form: P(|Z + sqrt lambda| > z) = power.
    let lambda: f64 = chi_square::noncentrality_for_power(1e-6, 1.0, 0.99).unwrap();
    let z = normal::isf(0.5e-6).unwrap();
    let power = normal::sf(z - lambda.sqrt()) + normal::sf(z + lambda.sqrt());
    assert!((power - 0.99).abs() < 1e-10, "{power}");
    assert_eq!(chi_square::noncentrality_for_power(0.5, 3.0, 0.2), Ok(0.0));
}

#[test]
fn binomial_matches_the_table() {
    let mut worst = Worst::default();
    for row in table("binomial") {
        let (k, n, p) = (row[0] as u64, row[1] as u64, row[2]);
        worst.relative(binomial::upper_tail(k, n, p).unwrap(), row[3], &row);
        worst.relative(binomial::lower_tail(k, n, p).unwrap(), row[4], &row);
        if row[3] > 1e-300 {
            let ln = binomial::ln_upper_tail(k, n, p).unwrap();
            assert!((ln - row[3].ln()).abs() < 1e-10, "{ln} at {row:?}");
        }
    }
    worst.below(1e-10);
}

#[test]
fn poisson_matches_the_table() {
    let mut worst = Worst::default();
    for row in table("poisson") {
        let (k, mean) = (row[0] as u64, row[1]);
        worst.relative(poisson::upper_tail(k, mean).unwrap(), row[2], &row);
        worst.relative(poisson::lower_tail(k - 1, mean).unwrap(), row[3], &row);
    }
    worst.below(1e-11);
}

#[test]
fn student_t_matches_the_table() {
    let mut worst = Worst::default();
    for row in table("student_t") {
        worst.relative(student_t::sf(row[0], row[1]).unwrap(), row[2], &row);
    }
    worst.below(1e-11);
    let (t, normal) = (student_t::sf(3.0, 9.9e14).unwrap(), normal::sf(3.0));
    assert!((t / normal - 1.0).abs() < 1e-11);
}

#[test]
fn kolmogorov_matches_the_table() {
    let (mut exact, mut expansion) = (Worst::default(), Worst::default());
    for row in table("kolmogorov") {
        let (d, n) = (row[0], row[1]);
        let got = kolmogorov::sf(d, n as u64).unwrap();
        let which = if n > 1000.0 && n * d * d < 4.0 { &mut expansion } else { &mut exact };
        which.relative(got, row[2], &row);
    }
    exact.below(1e-10);
    expansion.below(2e-6);
}

#[test]
fn thinned_one_sided_sum_agrees_with_the_full_one() {
    // 100 000 is the last size at which every term is taken: the tail must pass on smoothly.
    for z in [2.0_f64, 3.0, 8.0, 18.0] {
        let tail = |n: u64| kolmogorov::sf(z / (n as f64).sqrt(), n).unwrap().ln();
        let (a, b, c) = (tail(99_999), tail(100_000), tail(100_001));
        assert!((a - 2.0 * b + c).abs() < 1e-9 * b.abs(), "{a} {b} {c}");
    }
}

#[test]
fn kolmogorov_of_huge_samples_is_the_limiting_distribution() {
    let limit = |z: f64| {
        2.0 * (1..50)
            .map(|k| f64::from(1 - 2 * ((k + 1) % 2)) * (-2.0 * (f64::from(k) * z).powi(2)).exp())
            .sum::<f64>()
    };
    for z in [0.6, 1.0, 1.5, 1.97, 2.5] {
        let got = kolmogorov::sf(z * 1e-8, 10_000_000_000_000_000).unwrap();
        assert!((got / limit(z) - 1.0).abs() < 1e-6, "{got} {}", limit(z));
    }
}

#[test]
fn two_sample_tail_counts_the_paths() {
    // Enumeration of every ordering of 5 and 7 values.
    let (m, n) = (5_u32, 7_u32);
    let mut hits = std::collections::BTreeMap::new();
    for order in (0_u32..1 << (m + n)).filter(|order| order.count_ones() == m) {
        let (mut i, mut j, mut largest) = (0_i64, 0_i64, 0);
        for bit in 0..m + n {
            if order >> bit & 1 == 1 {
                i += 1
            } else {
                j += 1
            }
            largest = largest.max((i * i64::from(n) - j * i64::from(m)).abs());
        }
        *hits.entry(largest).or_insert(0) += 1;
    }
    let total: i32 = hits.values().sum();
    assert_eq!(total, 792);
    for &distance in hits.keys() {
        let truth = f64::from(hits.range(distance..).map(|(_, count)| count).sum::<i32>()) / 792.0;
        let got = kolmogorov::two_sample_sf(distance as f64 / 35.0, 5, 7).unwrap();
        assert!((got / truth - 1.0).abs() < 1e-13, "{distance}: {got} {truth}");
    }
}

#[test]
fn two_samples_of_one_size_have_a_closed_form() {
    // P(D >= k/n) = 2 sum_j (-1)^(j-1) C(2n, n - j k) / C(2n, n) (Gnedenko and Korolyuk 1951). At 15 000 a lattice that is
    // walked in full would be too large.
    for (n, k) in [(6_u64, 4_u64), (100, 20), (15_000, 150), (15_000, 300)] {
        let ratio =
            |shift: u64| (1..=shift).map(|i| (n - shift + i) as f64 / (n + i) as f64).product::<f64>();
        let signed = (1..=n / k).map(|j| ratio(j * k) * if j % 2 == 1 { 2.0 } else { -2.0 });
        let (got, truth) =
            (kolmogorov::two_sample_sf(k as f64 / n as f64, n, n).unwrap(), signed.sum::<f64>());
        assert!((got / truth - 1.0).abs() < 1e-10, "{got} {truth} at {n} {k}");
    }
}

#[test]
fn two_huge_samples_are_one_of_their_harmonic_size() {
    // m n / (m + n) = 1 200 000.
    for z in [0.7, 1.0, 1.7] {
        let d = z / 1_200_000_f64.sqrt();
        let truth = kolmogorov::sf(d, 1_200_000).unwrap();
        for (m, n) in [(2_000_000, 3_000_000), (3_000_000, 2_000_000)] {
            let got = kolmogorov::two_sample_sf(d, m, n).unwrap();
            assert!((got / truth - 1.0).abs() < 1e-6, "{got} {truth} at {z}");
        }
    }
}

#[test]
fn two_sample_statistic_handles_ties() {
    let a = [0.0, 1.0, 1.0, 2.0];
    let b = [1.0, 1.0, 2.0, 3.0];
    assert_eq!(kolmogorov::two_sample(&a, &a).unwrap().statistic, 0.0);
    assert_eq!(kolmogorov::two_sample(&a, &a).unwrap().p, 1.0);
    assert_eq!(kolmogorov::two_sample(&a, &b).unwrap().statistic, 0.25);
}

#[test]
#[ignore = "long: sums of the exact form where it ends"]
fn two_sample_tail_passes_on_to_the_asymptotic_form() {
    passes_on(1.5);
}

#[test]
#[ignore = "long: the largest lattices"]
fn two_sample_tail_passes_on_everywhere() {
    [1.0, 2.5].into_iter().for_each(passes_on);
}

/// Just below and above the largest lattice.
fn passes_on(z: f64) {
    let tail = |n: u64| kolmogorov::two_sample_sf(z * (2.0 / n as f64).sqrt(), n, n + 1).unwrap();
    let size = 2e8 / (2.0 * 2.0_f64.sqrt() * z);
    let size = size.powf(2.0 / 3.0) as u64;
    let (exact, asymptotic) = (tail(size * 99 / 100), tail(size * 101 / 100));
    assert!((exact / asymptotic - 1.0).abs() < 0.03, "{exact} {asymptotic}");
}

#[test]
fn anderson_darling_limit_matches_the_table() {
    let mut worst = Worst::default();
    for row in table("anderson_darling_limit") {
        worst.relative(anderson_darling::limit_sf(row[0]), row[1], &row);
    }
    worst.below(1e-12);
}

#[test]
fn anderson_darling_of_small_samples_matches_a_simulation() {
    for row in table("anderson_darling_simulated") {
        let share = row[2] / row[3];
        let error = (share * (1.0 - share) / row[3]).sqrt();
        let got = anderson_darling::sf(row[0], row[1] as u64).unwrap();
        println!("{row:?}: {got:.6} {share:.6} {:+.1} sigma", (got - share) / error);
        let model = match row[1] as u64 {
            0..4 => 1.5e-2,
            4..16 => 6e-4,
            _ => 1e-4,
        };
        assert!((got - share).abs() < model + 4.0 * error, "{got}, simulated {share} +- {error} at {row:?}");
    }
    // One sample: A^2 >= z unless u (1 - u) > exp(-1 - z).
    let u = 0.03_f64;
    let figure = anderson_darling::one_sample(&[u]).unwrap();
    assert!((figure.p - 2.0 * u).abs() < 1e-14);
}

#[test]
fn anderson_darling_correction_is_the_published_one() {
    // `errfix` of Marsaglia and Marsaglia (2004), written out by powers in mpmath, on the limits of the table: 0.2 is in
    // its first range, 0.5 and 1 in the second, the others in the third, of which the last two keep the size at 1e-3.
    let mut worst = Worst::default();
    for (z, sizes) in [
        (0.2, [0.9977948514334041, 0.9909943669198827, 0.9904624973036641]),
        (0.5, [0.7325915421953225, 0.7426306335352559, 0.7457817986827059]),
        (1.0, [0.3489401384045256, 0.35504383533729147, 0.35673179042988548]),
        (2.5, [0.053631440412633143, 0.0507682261870771, 0.049847907328862659]),
        (4.0, [0.010132709891832404, 0.009142543807289022, 0.00882427613725722]),
        (10.0, [1.8720348726810253e-5, 1.528662940552318e-5, 1.4182933909395193e-5]),
        (20.0, [6.050487298982932e-10, 4.940696266513225e-10, 4.5839777203622476e-10]),
    ] {
        for (n, truth) in [3, 10, 40].into_iter().zip(sizes) {
            worst.relative(anderson_darling::sf(z, n).unwrap(), truth, (z, n));
        }
    }
    worst.below(1e-10);
    assert!(anderson_darling::sf(1.0, 0).is_err());
}

#[test]
fn welch_matches_a_worked_example() {
    // t and p by SciPy 1.17 (ttest_ind, equal_var=False).
    let a: Moments =
        [27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1, 21.9, 22.6, 23.1, 19.6, 19.0, 21.7, 21.4]
            .into_iter()
            .collect();
    let b: Moments =
        [27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0, 24.8, 20.2, 21.9, 22.1, 22.9, 30.5, 24.4]
            .into_iter()
            .collect();
    let found = welch_t_test(Summary::from(&a), Summary::from(&b)).unwrap();
    println!("{found:?}");
    assert!((found.p - WELCH_P).abs() < 1e-10 && (found.t - WELCH_T).abs() < 1e-10, "{found:?}");
    let same = Summary { mean: 1.0, variance: 0.0, count: 5 };
    assert_eq!(welch_t_test(same, same).unwrap().p, 1.0);
    assert_eq!(welch_t_test(same, Summary { mean: 2.0, ..same }).unwrap().p, 0.0);
    let one: Moments = [1.0].into_iter().collect();
    let error = welch_t_test(same, Summary::from(&one)).unwrap_err();
    assert_eq!(error, Error::TooFew { name: "sample", len: 1, min: 2 });
}
const WELCH_T: f64 = -2.8529548701715215;
const WELCH_P: f64 = 0.008071938172194903;

#[test]
fn chi_square_statistic_and_its_errors() {
    let figure =
        chi_square::statistic(&[16, 18, 16, 14, 12, 12, 0], &[16.0, 16.0, 16.0, 16.0, 16.0, 8.0, 0.0])
            .unwrap();
    assert_eq!((figure.statistic, figure.df), (3.5, 5.0));
    assert!((figure.ln_p - figure.p.ln()).abs() < 1e-14);
    let impossible = chi_square::statistic(&[9999, 1], &[10_000.0, 0.0]).unwrap();
    assert_eq!((impossible.p, impossible.ln_p), (0.0, f64::NEG_INFINITY));
    assert_eq!(chi_square::g_statistic(&[9999, 1], &[10_000.0, 0.0]).unwrap().p, 0.0);
    let single = chi_square::statistic(&[7], &[7.0]).unwrap();
    assert_eq!((single.df, single.p), (0.0, 1.0));
    for (observed, expected, part) in [
        (&[1_u64][..], &[1.0, 2.0][..], "observed has 1 elements, but expected has 2"),
        (&[1, 2], &[1.0, f64::NAN], "expected[1] is NaN"),
        (&[1, 2], &[-1.0, 4.0], "expected[0] is -1"),
        (&[500, 500], &[500.0, 400.0], "add up to 1000, expected counts to 900"),
        (&[], &[], "at least 1"),
    ] {
        let message = chi_square::statistic(observed, expected).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn beta_has_closed_forms() {
    let mut worst = Worst::default();
    for x in [0.01_f64, 0.3, 0.5, 0.77] {
        for a in [0.2, 1.0, 3.5, 40.0] {
            worst.relative(beta::lower(a, 1.0, x).unwrap(), x.powf(a), (a, x));
            worst.relative(beta::lower(1.0, a, x).unwrap(), 1.0 - (1.0 - x).powf(a), (a, x));
        }
        worst.relative(beta::lower(2.0, 2.0, x).unwrap(), x * x * (3.0 - 2.0 * x), x);
        worst.relative(beta::lower(0.5, 0.5, x).unwrap(), x.sqrt().asin() / std::f64::consts::FRAC_PI_2, x);
    }
    worst.below(1e-13);
    assert_eq!((beta::lower(2.0, 3.0, 0.0), beta::lower(2.0, 3.0, 1.0)), (Ok(0.0), Ok(1.0)));
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        assert!(beta::lower(bad, 1.0, 0.5).is_err() && beta::lower(1.0, bad, 0.5).is_err(), "{bad}");
    }
    assert!(beta::lower(1.0, 1.0, 1.5).is_err());
}

#[test]
fn binomial_of_few_trials_is_counted_by_hand() {
    use binomial::{ln_lower_tail, pmf};
    let near = |got: Result<f64, Error>, truth: f64| assert!((got.unwrap() - truth).abs() < 1e-13, "{truth}");
    near(pmf(4, 4, 0.5), 1.0 / 16.0);
    assert_eq!(pmf(5, 4, 0.5), Ok(0.0));
    // Trials that always hit or always miss.
    assert_eq!([0, 1, 3].map(|k| pmf(k, 3, 0.0)), [Ok(1.0), Ok(0.0), Ok(0.0)]);
    assert_eq!([0, 1, 3].map(|k| pmf(k, 3, 1.0)), [Ok(0.0), Ok(0.0), Ok(1.0)]);
    // ln(1 - p) has the digits of p.
    near(pmf(0, 1_000_000_000_000, 1e-12), f64::exp(-1.0 - 0.5e-12));
    near(ln_lower_tail(0, 1000, 0.9), 1000.0 * f64::ln(1.0 - 0.9));
    near(ln_lower_tail(1, 3, 0.25), f64::ln(27.0 / 32.0));
    assert_eq!(ln_lower_tail(3, 3, 0.25), Ok(0.0));
    let interval = binomial::Interval { lower: 0.25, upper: 0.5 };
    assert_eq!([0.2, 0.25, 0.3, 0.5, 0.6].map(|x| interval.contains(x)), [false, true, true, true, false]);
}

#[test]
fn chi_square_counts_by_hand() {
    // Totals may differ by a tenth of a standard deviation: a cell counts with its own difference.
    assert!((chi_square::statistic(&[101, 100], &[100.0; 2]).unwrap().statistic - 0.01).abs() < 1e-15);
    assert!(chi_square::statistic(&[500, 500], &[500.0, 497.0]).is_ok());
    assert!(chi_square::statistic(&[500, 500], &[500.0, 496.0]).is_err());
    assert_eq!(chi_square::statistic(&[49, 50, 1], &[50.0, 50.0, 0.0]).unwrap().statistic, f64::INFINITY);
    // Williams: q = 1 + (sum 1/q_i - 1) / (6 N (cells - 1)).
    let (observed, expected) = ([10, 20, 30, 0], [12.0, 18.0, 30.0, 0.0]);
    let g = 2.0 * (10.0 * f64::ln(10.0 / 12.0) + 20.0 * f64::ln(20.0 / 18.0));
    let q = 1.0 + (5.0 + 10.0 / 3.0 + 2.0 - 1.0) / (6.0 * 60.0 * 2.0);
    let found = chi_square::williams_g_statistic(&observed, &expected).unwrap();
    assert!((found.statistic - g / q).abs() < 1e-13 && found.df == 2.0, "{found:?}");
}

#[test]
fn independence_of_a_table_by_hand() {
    // Four cells: n (a d - b c)^2 / (product of the margins); empty rows and columns are none.
    let truth = 100.0 * (10.0 * 40.0 - 20.0 * 30.0_f64).powi(2) / (30.0 * 70.0 * 40.0 * 60.0);
    let found = chi_square::independence(&[10, 0, 20, 0, 0, 0, 30, 0, 40], 3).unwrap();
    assert!((found.statistic - truth).abs() < 1e-13 && found.df == 1.0, "{found:?}");
    // X^2 = n (sum O^2 / (row column) - 1).
    let table = [[12_u64, 7, 3, 9], [5, 11, 6, 2], [8, 4, 13, 10]];
    let row = |r: usize| table[r].iter().sum::<u64>() as f64;
    let column = |c: usize| table.iter().map(|row| row[c]).sum::<u64>() as f64;
    let n = (0..3).map(row).sum::<f64>();
    let cells = (0..3).flat_map(|r| (0..4).map(move |c| (r, c)));
    let sum: f64 = cells.map(|(r, c)| (table[r][c] as f64).powi(2) / (row(r) * column(c))).sum();
    let found = chi_square::independence(table.as_flattened(), 4).unwrap();
    assert!((found.statistic - n * (sum - 1.0)).abs() < 1e-12 && found.df == 6.0, "{found:?}");
    for (counts, columns) in [(&[][..], 0), (&[1, 2, 3, 4], 0), (&[1, 2, 3, 4, 5], 2), (&[1, 2, 3, 4], 3)] {
        let error = chi_square::independence(counts, columns).unwrap_err();
        assert!(matches!(error, Error::Argument { name: "columns", .. }), "{error}");
    }
    for counts in [[1, 2, 0, 0], [1, 0, 2, 0]] {
        assert!(matches!(chi_square::independence(&counts, 2), Err(Error::TooFew { len: 1, .. })));
    }
}

#[test]
fn gamma_has_closed_forms() {
    let mut worst = Worst::default();
    for x in [1e-9_f64, 0.3, 1.0, 2.5, 30.0] {
        worst.relative(gamma::lower(1.0, x).unwrap(), -(-x).exp_m1(), x);
        worst.relative(gamma::upper(1.0, x).unwrap(), (-x).exp(), x);
        worst.relative(gamma::upper(3.0, x).unwrap(), (1.0 + x + 0.5 * x * x) * (-x).exp(), x);
    }
    worst.below(1e-13);
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        assert!(gamma::lower(bad, 1.0).is_err() && gamma::upper(bad, 1.0).is_err(), "{bad}");
    }
    for bad in [-1.0, f64::NAN] {
        assert!(gamma::lower(1.0, bad).is_err() && gamma::upper(1.0, bad).is_err(), "{bad}");
    }
}

#[test]
fn what_is_not_sorted_is_refused_by_name() {
    let refused = |values: &[f64], at: usize| {
        for error in
            [kolmogorov::one_sample(values).unwrap_err(), anderson_darling::one_sample(values).unwrap_err()]
        {
            assert!(matches!(error, Error::Element { index, .. } if index == at), "{error} of {values:?}");
        }
    };
    refused(&[-0.1, 0.5], 0);
    refused(&[0.1, 0.5, 1.5], 2);
    refused(&[0.1, f64::NAN, 0.5], 1);
    refused(&[0.1, 0.5, 0.7, 0.6], 3);
    assert!(kolmogorov::two_sample(&[-7.0, 0.0], &[1.5, 3.0]).is_ok());
    for bad in [&[2.0, 1.0][..], &[f64::NAN, 1.0], &[]] {
        assert!(kolmogorov::two_sample(bad, &[1.0]).is_err() && kolmogorov::two_sample(&[1.0], bad).is_err());
    }
    assert!(kolmogorov::sf(0.5, 0).is_err());
    assert!(kolmogorov::two_sample_sf(0.5, 0, 3).is_err() && kolmogorov::two_sample_sf(0.5, 3, 0).is_err());
    // The distance is found on either side of a step.
    for (values, distance) in [([0.3, 0.95], 0.45), ([0.05, 0.7], 0.45), ([0.5, 0.6], 0.5), ([0.1, 0.2], 0.8)]
    {
        let found = kolmogorov::one_sample(&values).unwrap().statistic;
        assert!((found - distance).abs() < 1e-15, "{found} of {values:?}");
    }
}

#[test]
fn many_tests_by_hand() {
    assert_eq!(multiplicity::sidak(0.5, 2), Ok(0.75));
    assert_eq!((multiplicity::sidak(0.5, 0), multiplicity::sidak(0.0, 7)), (Ok(0.0), Ok(0.0)));
    assert!(multiplicity::sidak(1.5, 2).is_err());
    assert_eq!(multiplicity::holm(&[0.01, 0.5, 0.25, 0.375]), Ok(vec![0.04, 0.75, 0.75, 0.75]));
    assert!(matches!(multiplicity::holm(&[0.5, 1.5]), Err(Error::Element { index: 1, .. })));
    let mut family = multiplicity::Family::new();
    assert!(family.is_empty() && family.smallest() == 1.0);
    assert_eq!(family.len(), 0);
    family.push("first", 0.75).unwrap();
    family.push("second", 0.125).unwrap();
    assert!(family.push("third", -0.1).is_err());
    assert!(!family.is_empty() && family.len() == 2 && family.smallest() == 0.25);
    let members: Vec<_> =
        family.adjusted().map(|test| (test.name.to_owned(), test.p, test.adjusted)).collect();
    assert_eq!(members, [("first".to_owned(), 0.75, 0.75), ("second".to_owned(), 0.125, 0.25)]);
}

#[test]
fn poisson_of_small_counts_by_hand() {
    use poisson::{ln_lower_tail, ln_upper_tail, lower_tail, pmf, two_sided, upper_tail};
    let near =
        |got: Result<f64, Error>, truth: f64| assert!((got.unwrap() / truth - 1.0).abs() < 1e-12, "{truth}");
    for mean in [1e-9_f64, 0.3, 2.0, 30.0] {
        near(pmf(0, mean), (-mean).exp());
        near(pmf(2, mean), 0.5 * mean * mean * (-mean).exp());
        near(lower_tail(1, mean), (1.0 + mean) * (-mean).exp());
        near(upper_tail(1, mean), -(-mean).exp_m1());
        near(ln_lower_tail(0, mean), -mean);
        let truth = if mean < 1.0 { (-(-mean).exp_m1()).ln() } else { (-(-mean).exp()).ln_1p() };
        near(ln_upper_tail(1, mean), truth);
    }
    // Here the quotient of count and mean overflows.
    near(ln_upper_tail(1, 1e-310), f64::ln(1e-310));
    near(two_sided(0, 3.0), 2.0 * f64::exp(-3.0));
    near(two_sided(3, 3.0), 1.0);
    near(two_sided(3, 0.01), 2.0 * upper_tail(3, 0.01).unwrap());
    assert_eq!((pmf(0, 0.0), pmf(1, 0.0), upper_tail(0, 0.0)), (Ok(1.0), Ok(0.0), Ok(1.0)));
    assert_eq!((upper_tail(1, 0.0), lower_tail(0, 0.0), ln_upper_tail(0, 2.0)), (Ok(0.0), Ok(1.0), Ok(0.0)));
    for bad in [-1.0, f64::INFINITY, f64::NAN] {
        assert!(pmf(1, bad).is_err() && upper_tail(0, bad).is_err() && lower_tail(0, bad).is_err(), "{bad}");
    }
}

#[test]
fn inverse_tails_have_closed_forms() {
    let (mut one, mut two, mut normal) = (Worst::default(), Worst::default(), Worst::default());
    for p in [1e-9_f64, 0.01, 0.3, 0.7, 0.99] {
        // Cauchy's distribution, and two degrees of freedom.
        one.relative(student_t::isf(p, 1.0).unwrap(), 1.0 / (std::f64::consts::PI * p).tan(), p);
        two.relative(student_t::isf(p, 2.0).unwrap(), (1.0 - 2.0 * p) / (2.0 * p * (1.0 - p)).sqrt(), p);
        normal.relative(normal::isf(p).unwrap(), student_t::isf(p, 1e16).unwrap(), p);
    }
    one.below(1e-10);
    two.below(1e-10);
    normal.below(1e-12);
    let ends = (Ok(f64::INFINITY), Ok(0.0), Ok(f64::NEG_INFINITY));
    assert_eq!((student_t::isf(0.0, 3.0), student_t::isf(0.5, 3.0), student_t::isf(1.0, 3.0)), ends);
    assert_eq!((normal::isf(0.0), normal::isf(0.5), normal::isf(1.0)), ends);
    assert!((normal::isf(0.975).unwrap() + 1.959963984540054).abs() < 1e-12);
    for bad in [-0.1, 1.5, f64::NAN] {
        assert!(student_t::isf(bad, 3.0).is_err() && normal::isf(bad).is_err(), "{bad}");
    }
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(student_t::isf(0.1, bad).is_err() && student_t::sf(0.1, bad).is_err(), "{bad}");
    }
    assert!(student_t::sf(f64::NAN, 3.0).is_err());
}

#[test]
fn welch_by_hand_and_what_it_refuses() {
    let a = Summary { mean: 20.0, variance: 4.0, count: 10 };
    let b = Summary { mean: 22.0, variance: 9.0, count: 12 };
    let (t, df) = (-2.0 / 1.15_f64.sqrt(), 1.15 * 1.15 / (0.16 / 9.0 + 0.5625 / 11.0));
    let found = welch_t_test(a, b).unwrap();
    assert!((found.t - t).abs() < 1e-14 && (found.df - df).abs() < 1e-12, "{found:?}");
    // By SciPy: ttest_ind_from_stats.
    assert!((found.p - 0.0775464387).abs() < 1e-9, "{found:?}");
    let still = |mean: f64, count: u64| Summary { mean, variance: 0.0, count };
    let found = welch_t_test(still(1.0, 5), still(2.0, 8)).unwrap();
    assert_eq!((found.t, found.df, found.p), (f64::NEG_INFINITY, 11.0, 0.0));
    let found = welch_t_test(still(1.0, 5), still(1.0, 8)).unwrap();
    assert_eq!((found.t, found.df, found.p), (0.0, 11.0, 1.0));
    assert!(welch_t_test(Summary { count: 2, ..a }, b).is_ok());
    for bad in [
        Summary { count: 1, ..a },
        Summary { mean: f64::INFINITY, ..a },
        Summary { variance: -1.0, ..a },
        Summary { variance: f64::INFINITY, ..a },
        Summary { variance: f64::NAN, ..a },
    ] {
        assert!(welch_t_test(bad, b).is_err() && welch_t_test(b, bad).is_err(), "{bad:?}");
    }
}

#[test]
fn chi_square_at_the_ends() {
    assert_eq!(chi_square::sf(0.0, 0.0), Ok(1.0));
    assert_eq!(chi_square::sf(1e-9, 0.0), Ok(0.0));
    assert_eq!(chi_square::cdf(0.0, 0.0), Ok(1.0));
    assert_eq!(chi_square::ln_sf(0.0, 0.0), Ok(0.0));
    assert_eq!(chi_square::sf(f64::INFINITY, 3.0), Ok(0.0));
    assert_eq!(chi_square::sf(-1.0, 3.0), Ok(1.0));
    assert_eq!(chi_square::isf(0.0, 3.0), Ok(f64::INFINITY));
    assert_eq!(chi_square::isf(1.0, 3.0), Ok(0.0));
    assert_eq!(chi_square::cdf(0.0, 3.0), Ok(0.0));
    // Two degrees of freedom: ln p = -x / 2, where p itself is 1.
    assert!((chi_square::ln_sf(1e-20, 2.0).unwrap() / -5e-21 - 1.0).abs() < 1e-12);
    for df in [0.0, -1.0, f64::INFINITY] {
        assert!(chi_square::isf(0.5, df).is_err(), "{df}");
    }
    for end in [0.0, 1.0, -0.5, 1.5] {
        assert!(binomial::clopper_pearson(3, 7, end).is_err(), "{end}");
        assert!(chi_square::noncentrality_for_power(end, 3.0, 0.9).is_err(), "{end}");
        assert!(chi_square::noncentrality_for_power(0.1, 3.0, end).is_err(), "{end}");
        assert!(chi_square::detectable_relative_error(1.0, 10, end).is_err(), "{end}");
    }
    assert!(chi_square::sf(f64::NAN, 3.0).is_err());
    assert!(chi_square::sf(1.0, f64::INFINITY).is_err());
    assert!(chi_square::sf(1.0, f64::NAN).is_err());
    assert!(chi_square::isf(f64::NAN, 1.0).is_err());
    assert!(chi_square::noncentral_sf(1.0, 1.0, f64::INFINITY).is_err());
    // statrs gives 9.3e-10 here.
    let x = chi_square::isf(1.0 - 1e-6, 1.0).unwrap();
    assert!((x / 1.570796326795e-12 - 1.0).abs() < 1e-9, "{x:e}");
}

#[test]
fn bad_arguments_are_errors_not_panics() {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, 1e-310, 0.5, 1.0, 1e300];
    for a in odd {
        let _ = (normal::sf(a), normal::ln_sf(a), normal::isf(a), anderson_darling::limit_sf(a));
        let _ = (multiplicity::sidak(a, 3), multiplicity::holm(&[a]), binomial::clopper_pearson(3, 7, a));
        let _ = (
            kolmogorov::one_sample(&[a]),
            anderson_darling::one_sample(&[a]),
            kolmogorov::two_sample(&[a], &[a]),
        );
        for n in [0, 1, 7, 1 << 40, u64::MAX] {
            let _ = (kolmogorov::sf(a, n), anderson_darling::sf(a, n));
            let _ = (poisson::upper_tail(n, a), poisson::lower_tail(n, a), poisson::pmf(n, a));
            let _ =
                (binomial::upper_tail(n, u64::MAX, a), binomial::lower_tail(n, 7, a), binomial::pmf(n, n, a));
        }
        for b in odd {
            let _ =
                (chi_square::sf(a, b), chi_square::ln_sf(a, b), chi_square::isf(a, b), student_t::sf(a, b));
            let _ = (gamma::lower(a, b), gamma::upper(a, b), beta::lower(a, b, 0.3), beta::lower(a, 2.0, b));
            let _ = chi_square::detectable_relative_error(a, 5, b);
            let _ = (chi_square::noncentral_sf(a, b, 1.0), chi_square::noncentral_sf(1.0, a, b));
        }
    }
}

#[test]
fn clopper_pearson_matches_published_limits() {
    // Clopper and Pearson's own kind of example: 10 of 50 at 95 % (R: binom.test(10, 50)).
    let interval = binomial::clopper_pearson(10, 50, 0.95).unwrap();
    println!("{interval:?}");
    assert!((interval.lower - 0.1003022).abs() < 1e-7 && (interval.upper - 0.3371831).abs() < 1e-7);
    for (k, n) in
        [(1, 1), (3, 1_000_000_000), (5_000_000_000, 10_000_000_000), (9_999_999_999, 10_000_000_000)]
    {
        let interval = binomial::clopper_pearson(k, n, 0.99).unwrap();
        let upper_tail = binomial::upper_tail(k, n, interval.lower).unwrap();
        assert!((upper_tail / 0.005 - 1.0).abs() < 1e-5, "{upper_tail} at {k} of {n}");
        assert!(interval.contains(k as f64 / n as f64));
    }
    assert!(binomial::clopper_pearson(8, 7, 0.9).is_err());
}

#[test]
fn compensated_sum_keeps_what_a_plain_sum_loses() {
    let terms = || (1..=1_000_000).map(|i| 1.0 / f64::from(i));
    let sum: CompensatedSum = terms().collect();
    assert!((sum.value() - 14.392726722865724).abs() < 4e-15); // harmonic number of a million
    assert_ne!(terms().sum::<f64>(), sum.value());
    let mut parts = [CompensatedSum::new(); 7];
    terms().enumerate().for_each(|(i, x)| parts[i % 7].add(x));
    let mut merged = CompensatedSum::new();
    parts.iter().for_each(|part| merged.merge(part));
    assert!((merged.value() - sum.value()).abs() < 1e-14);
    let half = |terms: [f64; 2]| terms.into_iter().collect::<CompensatedSum>();
    let mut both = half([1.0, 1e100]);
    both.merge(&half([1.0, -1e100]));
    assert_eq!(both.value(), 2.0);
    assert_eq!([1.0, 1e100, 1.0, -1e100].into_iter().sum::<CompensatedSum>().value(), 2.0);
    let infinite: CompensatedSum = [1.0, f64::INFINITY, 2.0].into_iter().collect();
    assert_eq!(infinite.value(), f64::INFINITY);
}

#[test]
fn moments_of_shifted_numbers_do_not_cancel() {
    let moments: Moments = [4.0, 7.0, 13.0, 16.0].iter().map(|x| x + 1e9).collect();
    assert_eq!((moments.mean(), moments.variance()), (1e9 + 10.0, Some(30.0)));
    assert_eq!(Moments::new().variance(), None);
}

proptest! {
    // The same cases in every run.
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(4), ..Default::default() })]

    #[test]
    fn chi_square_sf_falls_and_isf_undoes_it(df in 0.1_f64..1e6, z in -6.0_f64..20.0, step in 1e-6_f64..1.0) {
        let sd = (2.0 * df).sqrt();
        let x = (df + z * sd).max(1e-3 * df);
        let (here, there) = (chi_square::sf(x, df).unwrap(), chi_square::sf(x + step * sd, df).unwrap());
        prop_assert!(here >= there);
        prop_assert!((here + chi_square::cdf(x, df).unwrap() - 1.0).abs() < 1e-14);
        if here < 0.99 {
            let back = chi_square::isf(here, df).unwrap();
            prop_assert!((back / x - 1.0).abs() < 1e-9, "{} {}", back, x);
        }
    }

    #[test]
    fn binomial_tails_add_up(n in 1_u64..2_000_000_000, p in 1e-6_f64..1.0, z in -5.0_f64..5.0) {
        let (mean, sd) = (n as f64 * p, (n as f64 * p * (1.0 - p)).sqrt());
        let k = (mean + z * sd).clamp(0.0, n as f64) as u64;
        let (upper, lower) = (binomial::upper_tail(k, n, p).unwrap(), binomial::lower_tail(k, n, p).unwrap());
        let pmf = binomial::pmf(k, n, p).unwrap();
        prop_assert!((upper + lower - 1.0 - pmf).abs() < 1e-11, "{} {} {}", upper, lower, pmf);
        prop_assert!(upper <= binomial::upper_tail(k.saturating_sub(1), n, p).unwrap());
        // One step changes the tail by the point probability: two routes to the same number.
        let next = binomial::upper_tail(k + 1, n, p).unwrap();
        prop_assert!((upper - next - pmf).abs() < 1e-11 * upper.max(1e-3), "{} {} {}", upper, next, pmf);
    }

    #[test]
    fn poisson_tails_add_up(mean in 1e-3_f64..1e9, z in -5.0_f64..5.0) {
        let k = (mean + z * mean.sqrt()).max(0.0) as u64;
        let (upper, lower) = (poisson::upper_tail(k, mean).unwrap(), poisson::lower_tail(k, mean).unwrap());
        prop_assert!((upper + lower - 1.0 - poisson::pmf(k, mean).unwrap()).abs() < 1e-11);
    }

    #[test]
    fn clopper_pearson_is_the_acceptance_region_of_the_two_sided_test(n in 1_u64..10_000, share in 0.0_f64..=1.0) {
        let k = (share * n as f64) as u64;
        let interval = binomial::clopper_pearson(k, n, 0.95).unwrap();
        prop_assert!(interval.contains(k as f64 / n as f64));
        for (end, outwards) in [(interval.lower, -1e-6), (interval.upper, 1e-6)] {
            if end > 0.0 && end < 1.0 {
                prop_assert!(binomial::two_sided(k, n, end * (1.0 - outwards)).unwrap() >= 0.05);
                prop_assert!(binomial::two_sided(k, n, (end * (1.0 + outwards)).min(1.0)).unwrap() <= 0.05 + 1e-12);
            }
        }
    }

    #[test]
    fn student_t_is_symmetric_and_falls(t in 0.0_f64..50.0, df in 0.5_f64..1e9) {
        let upper = student_t::sf(t, df).unwrap();
        prop_assert!((upper + student_t::sf(-t, df).unwrap() - 1.0).abs() < 1e-14);
        // Among denormals a step may be too small to see.
        prop_assert!(student_t::sf(t + 0.01, df).unwrap() < upper || upper < 1e-300);
        prop_assert!(upper >= normal::sf(t) * (1.0 - 1e-11));
    }

    #[test]
    fn kolmogorov_sf_falls(n in 1_u64..3000, z in 0.1_f64..4.0) {
        let d = z / (n as f64).sqrt();
        let (here, there) = (kolmogorov::sf(d, n).unwrap(), kolmogorov::sf(d * 1.01, n).unwrap());
        prop_assert!(here >= there - 1e-9 * here, "{} {}", here, there);
    }

    #[test]
    fn two_sample_is_symmetric(a in prop::collection::vec(-1.0_f64..1.0, 1..60), b in prop::collection::vec(-1.0_f64..1.0, 1..60)) {
        let (mut a, mut b) = (a, b);
        a.sort_by(f64::total_cmp);
        b.sort_by(f64::total_cmp);
        let (one, two) = (kolmogorov::two_sample(&a, &b).unwrap(), kolmogorov::two_sample(&b, &a).unwrap());
        prop_assert_eq!(one, two);
        let again = kolmogorov::two_sample_sf(one.statistic, a.len() as u64, b.len() as u64).unwrap();
        prop_assert_eq!(one.p, again);
    }

    #[test]
    fn adjusted_p_values_keep_their_order(mut p in prop::collection::vec(0.0_f64..=1.0, 0..40), tiny in -300.0_f64..0.0) {
        p.push(10_f64.powf(tiny));
        let adjusted = multiplicity::holm(&p).unwrap();
        for i in 0..p.len() {
            prop_assert!(adjusted[i] >= p[i] && adjusted[i] <= (p[i] * p.len() as f64).min(1.0));
            prop_assert!(multiplicity::sidak(p[i], p.len() as u64).unwrap() <= p[i] * p.len() as f64 * (1.0 + 1e-14));
            for j in 0..p.len() {
                prop_assert!(p[i] > p[j] || adjusted[i] <= adjusted[j]);
            }
        }
    }

    #[test]
    fn merged_moments_are_the_moments_of_all(x in prop::collection::vec(-1e3_f64..1e3, 2..200), cut in 0.0_f64..1.0) {
        let all: Moments = x.iter().copied().collect();
        let (left, right) = x.split_at((cut * x.len() as f64) as usize);
        let mut merged: Moments = left.iter().copied().collect();
        merged.merge(&right.iter().copied().collect());
        prop_assert_eq!(merged.count(), all.count());
        prop_assert!((merged.mean() - all.mean()).abs() < 1e-10);
        prop_assert!((merged.variance().unwrap() - all.variance().unwrap()).abs() < 1e-8);
        prop_assert!((merged.skewness().unwrap() - all.skewness().unwrap()).abs() < 1e-7);
        prop_assert!((merged.kurtosis().unwrap() - all.kurtosis().unwrap()).abs() < 1e-7);
        prop_assert_eq!((merged.smallest(), merged.largest()), (all.smallest(), all.largest()));
    }

    #[test]
    fn g_and_pearson_agree_near_the_expected_counts(e in prop::collection::vec(1e4_f64..1e6, 2..20), z in -1.0_f64..1.0) {
        let mut expected: Vec<f64> = e.iter().map(|e| e.round()).collect();
        let mut observed: Vec<u64> = expected.iter().map(|&e| (e + z * e.sqrt()) as u64).collect();
        let (o, e): (u64, f64) = (observed.iter().sum(), expected.iter().sum());
        let missing = o as f64 - e;
        expected.push(1e6 + missing.max(0.0));
        observed.push((1e6 + (-missing).max(0.0)) as u64);
        let (x, g) = (chi_square::statistic(&observed, &expected).unwrap(), chi_square::g_statistic(&observed, &expected).unwrap());
        prop_assert!((x.statistic - g.statistic).abs() < 0.05 * x.statistic + 1e-6, "{:?} {:?}", x, g);
    }
}
