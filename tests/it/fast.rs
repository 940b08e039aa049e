//! The fast forms of tables and maps: the same masses, the same answers, the same bits.

use glam::{DVec3, Vec2, Vec3};
use rand::Rng;
use std::sync::Arc;
use warpcheck::domain::{Domain, Pixels, Sphere, Uncounted};
use warpcheck::histogram::Histogram;
use warpcheck::random::{fill_unit, stream, unit_f64};
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Report, Settings};

/// Weights over eight orders of magnitude, with zeros.
fn ragged(entries: usize, seed: u64) -> Vec<f64> {
    let mut rng = stream(seed, "weights", 0);
    let mut draw = || {
        let u = unit_f64(&mut rng);
        if u < 0.1 { 0.0 } else { 10.0_f64.powf(8.0 * u) }
    };
    let mut weights: Vec<f64> = (0..entries).map(|_| draw()).collect();
    weights[entries / 2] += 1.0;
    weights
}

/// As the areas of a mesh.
fn uneven(entries: usize) -> Vec<f64> {
    let mut rng = stream(9, "weights", 0);
    (0..entries).map(|_| 10.0_f64.powf(4.0 * unit_f64(&mut rng))).collect()
}

fn kinds() -> Vec<(&'static str, Vec<f64>)> {
    let mut runs = vec![0.0; 5000];
    runs[1000..1400].fill(1.0);
    let mut crowd = vec![1e-9; 3000];
    crowd[7] = 1.0;
    let mut last = vec![0.0; 100];
    last[99] = 2.0;
    vec![
        ("one", vec![0.3]),
        ("two", vec![0.0, 5e-324]),
        ("four", vec![1.0, 0.0, 2.0, 0.0]),
        ("five", vec![0.0, 1.0, 2.0, 3.0, 0.0]),
        ("equal", vec![1.0; 4096]),
        ("odd", vec![1.0; 1023]),
        ("ragged", ragged(1000, 1)),
        ("ragged, large", ragged(70_000, 2)),
        ("zeros around", runs),
        ("thousands in one bucket", crowd),
        ("the last only", last),
    ]
}

/// Variates where something may go wrong: the knots and what lies next to them, the ends, what is no variate, and some others.
fn variates(cdf: &DiscreteCdf) -> Vec<f64> {
    let step = cdf.len().div_ceil(5000);
    let mut all: Vec<f64> = (0..=cdf.len())
        .step_by(step)
        .map(|i| cdf.cumulative(i))
        .flat_map(|knot| [knot, knot.next_up(), knot.next_down()])
        .collect();
    all.extend([0.0, -0.0, 5e-324, 0.5, 1.0_f64.next_down(), 1.0, -1.0, f64::NAN, f64::INFINITY]);
    let mut rng = stream(4, "variates", 0);
    all.extend((0..2000).map(|_| unit_f64(&mut rng)));
    all
}

#[test]
fn a_guide_answers_like_the_cdf_and_batches_like_single_variates() {
    for (name, weights) in kinds() {
        let cdf = DiscreteCdf::new(&weights).unwrap();
        let xi = variates(&cdf);
        for form in [Form::Cdf, Form::Guide, Form::Alias, Form::Ordered, Form::Unordered] {
            let table = DiscreteTable::new(&weights, form).unwrap();
            let single: Vec<Choice> = xi.iter().map(|&xi| table.choose(xi)).collect();
            for (&xi, choice) in xi.iter().zip(&single) {
                assert!(weights[choice.index] > 0.0, "{name}, {form:?}, {xi}: {choice:?}");
                assert!((0.0..1.0).contains(&choice.rest), "{name}, {form:?}, {xi}: {choice:?}");
                assert_eq!(choice.mass, table.mass(choice.index), "{name}, {form:?}, {xi}");
            }
            let mut batch = vec![Choice::default(); xi.len()];
            table.choose_all(&xi, &mut batch);
            assert_eq!(single, batch, "{name}, {form:?}");
            let mut filled = vec![None; xi.len()];
            table.fill(&xi, &mut filled);
            for (choice, sample) in single.iter().zip(filled) {
                assert_eq!(sample, Some(Sample { point: choice.index, density: choice.mass }), "{name}");
            }
            // Raw bits are the variate of their upper 53.
            let mut rng = stream(5, "bits", 0);
            let bits: Vec<u64> = (0..1000).map(|_| rng.next_u64()).collect();
            let mut indices = vec![0; bits.len()];
            table.indices(&bits, &mut indices);
            for (bits, index) in bits.iter().zip(indices) {
                let xi = (bits >> 11) as f64 / 9_007_199_254_740_992.0;
                assert_eq!(index as usize, table.choose(xi).index, "{name}, {form:?}, {xi}");
            }
            for (i, &w) in weights.iter().enumerate() {
                assert_eq!(table.mass(i).to_bits(), cdf.mass(i).to_bits(), "{name}, {form:?}, {i}");
                assert_eq!(table.mass(i) > 0.0, w > 0.0, "{name}, {form:?}, {i}");
            }
            if matches!(table.form(), Form::Cdf | Form::Guide) {
                let ours: Vec<Choice> = xi.iter().map(|&xi| cdf.choose(xi)).collect();
                assert_eq!(single, ours, "{name}, {form:?}");
                let mut sorted = xi.clone();
                sorted.retain(|xi| !xi.is_nan());
                sorted.sort_by(f64::total_cmp);
                assert!(
                    sorted.is_sorted_by_key(|&xi| table.choose(xi).index),
                    "{name}, {form:?}: order is lost"
                );
            }
        }
    }
}

#[test]
fn the_form_is_chosen_by_entries_and_order() {
    let form = |entries: usize, form| DiscreteTable::new(&vec![1.0; entries], form).unwrap().form();
    assert_eq!([form(2, Form::Ordered), form(2, Form::Unordered)], [Form::Cdf; 2]);
    assert_eq!([form(1000, Form::Ordered), form(1000, Form::Unordered)], [Form::Guide, Form::Alias]);
    assert_eq!(form(2, Form::Alias), Form::Alias);
}

/// q in 128 bits would be out of 2^53; the weights are made to be integers too, so that the noncentrality sum (q - p)^2 / p has one rounding a term.
fn noncentrality(weights: &[u64], mass: impl Fn(usize) -> f64) -> f64 {
    let total: u128 = weights.iter().map(|&w| u128::from(w)).sum();
    let mut sum = 0.0;
    for (i, &w) in weights.iter().enumerate() {
        let steps = mass(i) * 2.0_f64.powi(53);
        assert_eq!(steps.fract(), 0.0, "a mass is a whole number of steps");
        // q - p = (steps total - w 2^53) / (2^53 total), the numerator without a rounding.
        let difference = (steps as u128 * total).abs_diff(u128::from(w) << 53) as f64;
        let scale = 2.0_f64.powi(53) * total as f64;
        sum += (difference / scale).powi(2) / (w as f64 / total as f64);
    }
    sum
}

#[test]
fn no_number_of_samples_tells_a_table_from_its_weights() {
    let integers: Vec<u64> = uneven(1 << 20).iter().map(|w| (w * 1_048_576.0) as u64).collect();
    let weights: Vec<f64> = integers.iter().map(|&w| w as f64).collect();
    for form in [Form::Cdf, Form::Guide, Form::Alias] {
        let table = DiscreteTable::new(&weights, form).unwrap();
        let found = noncentrality(&integers, |i| table.mass(i));
        println!("{form:?}: {found:e} a sample");
        assert!(found < 1e-15, "{form:?}: {found:e}");
    }
    // What a CDF in f32 has.
    let ends: Vec<f32> = {
        let total: f64 = weights.iter().sum();
        let sums = weights.iter().scan(0.0, |sum, w| {
            *sum += w;
            Some(*sum)
        });
        sums.map(|sum| (sum / total) as f32).collect()
    };
    let broken = noncentrality(&integers, |i| f64::from(ends[i] - if i > 0 { ends[i - 1] } else { 0.0 }));
    assert!(broken > 1e-6, "{broken:e}");
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// Clouds, a black row, black texels, one bright one.
fn sky(width: usize, height: usize) -> Arc<RadianceMap> {
    let mut rng = stream(6, "map", 0);
    let mut texels: Vec<[f32; 3]> = (0..width * height)
        .map(|i| {
            let u = unit_f64(&mut rng) as f32;
            let base = 0.3 + (i as f32 * 0.01).sin().abs();
            if u < 0.05 { [0.0; 3] } else { [base, u, 0.5 * base] }
        })
        .collect();
    if height > 2 {
        texels[width..2 * width].fill([0.0; 3]);
    }
    texels[width * height / 3] = [3e3; 3];
    Arc::new(RadianceMap::new(width, height, texels).unwrap())
}

const ROWS: [RowWarp; 2] = [RowWarp::UniformV, RowWarp::UniformCosTheta];
const FORMS: [Form; 2] = [Form::Guide, Form::Alias];

#[test]
fn one_thread_and_two_make_the_same_tables() {
    let weights = ragged(200_000, 3);
    let map = sky(640, 320);
    let mut rng = stream(7, "xi", 0);
    let xi: Vec<[f64; 2]> = (0..20_000).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect();
    let make = || {
        let table = DiscreteAlias::new(&weights).unwrap();
        let maps = FORMS.map(|form| {
            let map = PackedEnvironment::new(map.clone(), RowWarp::UniformV, form).unwrap();
            let mut out = vec![EnvironmentSample::default(); xi.len()];
            map.sample_all(&xi, &mut out);
            out
        });
        (table, maps)
    };
    let (one, two) = (pool(1).install(make), pool(2).install(make));
    assert!(one.0 == two.0, "the alias table differs");
    assert!(one.1 == two.1, "the maps differ");
}

#[test]
fn packed_maps_sample_what_they_claim() {
    for (width, height) in [(1, 1), (1, 4), (5, 1), (2, 2), (3, 7), (64, 32), (100, 77)] {
        let map = sky(width, height);
        for rows in ROWS {
            let baseline = Environment::from_map((*map).clone(), rows).unwrap();
            for form in FORMS {
                let packed = PackedEnvironment::new(map.clone(), rows, form).unwrap();
                let name = format!("{rows:?}, {form:?}, {width} x {height}");
                let mut total = 0.0;
                for (row, column) in (0..height).flat_map(|r| (0..width).map(move |c| (r, c))) {
                    let mass = packed.texel_mass(column, row);
                    total += mass;
                    assert_eq!(
                        mass > 0.0,
                        luminance(baseline.texel(column, row)) > 0.0,
                        "{name}: {column} {row}"
                    );
                    let off = (mass - baseline.texel_mass(column, row)).abs();
                    assert!(off < 1e-9, "{name}: {column} {row}: off by {off:e}");
                }
                assert!((total - 1.0).abs() < 1e-12, "{name}: {total}");
                let mut rng = stream(8, "xi", 0);
                let ends = [0.0, 0.5, 1.0_f64.next_down(), 1.0, f64::NAN, -1.0, 5e-324];
                let mut xi: Vec<[f64; 2]> =
                    (0..4003).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect();
                xi.extend(ends.iter().flat_map(|&a| ends.map(|b| [a, b])));
                let mut samples = vec![EnvironmentSample::default(); xi.len()];
                packed.sample_all(&xi, &mut samples);
                let mut uv = vec![[0.0; 2]; xi.len()];
                packed.uv_all(&xi, &mut uv);
                for ((&xi, sample), uv) in xi.iter().zip(&samples).zip(uv) {
                    assert_eq!(*sample, packed.sample(xi), "{name}: {xi:?}");
                    assert_eq!(sample.uv.to_array(), uv, "{name}: {xi:?}");
                    assert!(sample.radiance != Vec3::ZERO, "{name}: {xi:?} draws a black texel");
                    assert!((sample.direction.length() - 1.0).abs() < 2e-7, "{name}: {xi:?}");
                    // The direction is in the texel that was drawn, by the other code too, and has its density.
                    assert_eq!(packed.map().radiance(sample.direction), sample.radiance, "{name}: {xi:?}");
                    let asked = packed.density(sample.direction);
                    assert!((asked / sample.density - 1.0).abs() < 1e-5, "{name}: {xi:?} {asked} {sample:?}");
                    let (sin_phi, cos_phi) = (std::f64::consts::TAU * uv[0]).sin_cos();
                    let (sine, cosine) = (std::f64::consts::PI * uv[1]).sin_cos();
                    let exact = DVec3::new(sine * cos_phi, sine * sin_phi, cosine);
                    let off = (sample.direction.as_dvec3() - exact).abs().max_element();
                    assert!(off < 4e-9 + 3.1e-8, "{name}: {xi:?} is off by {off:e}");
                }
            }
        }
    }
}

#[test]
fn guides_of_a_map_keep_the_order_of_both_variates() {
    let map = PackedEnvironment::new(sky(300, 200), RowWarp::UniformV, Form::Ordered).unwrap();
    let grid: Vec<f64> = (0..5000).map(|i| f64::from(i) / 5000.0).collect();
    assert!(grid.is_sorted_by_key(|&xi| map.sample([xi, 0.3]).uv.y));
    assert!(grid.is_sorted_by_key(|&xi| map.sample([0.3, xi]).uv.x));
}

/// Lines of memory are told apart by 16 bits of a row's steps, and hundreds of them can lie between two of these. Every border of texels, and the
/// variates next to it, must still lead to the texel that the masses say.
#[test]
fn crowded_rows_lead_to_the_texel_that_the_masses_say() {
    for width in [15, 16, 17, 511, 512, 513, 9000] {
        // Two suns over a dim row, a row without light, and one that gets lighter by powers.
        let dim =
            (0..width).map(|i| if i == width / 3 || i == width - 2 { 1e9 } else { 1.0 + (i % 3) as f32 });
        let dark = (0..width).map(|_| 0.0);
        let steep = (0..width).map(|i| 2.0_f32.powf(-60.0 * i as f32 / width as f32));
        let texels = dim.chain(dark).chain(steep).map(|x| [x; 3]).collect();
        let map = RadianceMap::new(width, 3, texels).unwrap();
        let map = PackedEnvironment::new(map, RowWarp::UniformV, Form::Ordered).unwrap();
        for row in [0, 2] {
            let masses: Vec<f64> = (0..width).map(|column| map.texel_mass(column, row)).collect();
            let row_mass: f64 = masses.iter().sum();
            let down = if row == 0 { 0.5 * row_mass } else { 1.0 - 0.5 * row_mass };
            // Masses are whole numbers of 2^-31 of the row's; so are the borders.
            let steps = masses.iter().map(|mass| (mass / row_mass * 2.0_f64.powi(31)).round());
            let (mut xi, mut wanted, mut start) = (Vec::new(), Vec::new(), 0.0);
            for (column, steps) in steps.enumerate().filter(|(_, steps)| *steps > 0.0) {
                for step in [start, start + (0.5 * steps).floor(), start + steps - 1.0] {
                    xi.push([down, (step + 0.5) / 2.0_f64.powi(31)]);
                    wanted.push((column, row));
                }
                start += steps;
            }
            assert_eq!(start, 2.0_f64.powi(31), "width {width}, row {row}");
            let mut uv = vec![[0.0; 2]; xi.len()];
            map.uv_all(&xi, &mut uv);
            for ((&[u, v], &wanted), xi) in uv.iter().zip(&wanted).zip(&xi) {
                let found = ((u * width as f64) as usize, (v * 3.0) as usize);
                assert_eq!(found, wanted, "width {width}: {xi:?}");
            }
        }
    }
}

/// At both ends of its variates and between them a texel is found: where rows or lines crowd into one bucket of a guide, beside black rows and texels, in
/// rows shorter than a line.
#[test]
fn texels_are_found_at_the_ends_of_their_variates() {
    let even: fn(usize, usize) -> f32 = |_, _| 1.0;
    let bright_row: fn(usize, usize) -> f32 =
        |_, row| if row % 700 == 350 { 1e6 } else { 1.0 + (row % 5) as f32 };
    let holes: fn(usize, usize) -> f32 =
        |column, row| if row % 3 == 1 || column % 7 == 2 { 0.0 } else { 0.1 };
    let steep: fn(usize, usize) -> f32 = |column, row| 2.0_f32.powi(-((column / 40 + row / 30) as i32));
    for (light, width, height) in [
        (even, 1, 1),
        (even, 1, 500),
        (even, 700, 1),
        (bright_row, 2, 3000),
        (bright_row, 40, 1400),
        (holes, 5, 9),
        (holes, 129, 31),
        (steep, 1000, 9),
        (steep, 17, 1000),
    ] {
        let texels = (0..width * height).map(|i| [light(i % width, i / width); 3]).collect();
        let map = RadianceMap::new(width, height, texels).unwrap();
        let map = PackedEnvironment::new(map, RowWarp::UniformV, Form::Ordered).unwrap();
        let (mut xi, mut texels) = (Vec::new(), Vec::new());
        for (column, row) in (0..height).flat_map(|row| (0..width).map(move |column| (column, row))) {
            let [down, across] = map.variates(column, row).unwrap();
            if map.texel_mass(column, row) == 0.0 {
                assert!(down.0 == down.1 || across.0 == across.1);
                continue;
            }
            let within = |(start, end): (f64, f64), step: f64| [start, 0.5 * (start + end), end - step];
            for y in within(down, 2.0_f64.powi(-53)) {
                xi.extend(within(across, 2.0_f64.powi(-53)).map(|x| [y, x]));
                texels.extend([(column, row); 3]);
            }
        }
        let mut uv = vec![[0.0; 2]; xi.len()];
        map.uv_all(&xi, &mut uv);
        for ((&[u, v], texel), xi) in uv.iter().zip(texels).zip(xi) {
            let found = ((u * width as f64) as usize, (v * height as f64) as usize);
            assert_eq!(found, texel, "{width} x {height}: {xi:?}");
        }
    }
}

#[test]
fn the_texel_of_a_direction_needs_no_inverse_functions() {
    // 1000 columns and rows: bins of 0.4 degrees.
    let (width, height) = (1000, 500);
    let texels = (0..width * height).map(|i| [1.0 + (i % 977) as f32, 1.0, 1.0]).collect();
    let map = RadianceMap::new(width, height, texels).unwrap();
    let baseline = Environment::from_map(map.clone(), RowWarp::UniformCosTheta).unwrap();
    let packed =
        FORMS.map(|form| PackedEnvironment::new(map.clone(), RowWarp::UniformCosTheta, form).unwrap());
    let mut rng = stream(10, "w", 0);
    for i in 0..200_000 {
        let mut at = [unit_f64(&mut rng), unit_f64(&mut rng)];
        if i % 4 == 0 {
            // Close to a corner of texels.
            at = [(at[0] * 500.0).round() / 500.0 + 1e-12, (at[1] * 1000.0).round() / 1000.0 + 1e-12];
        }
        let w = Sphere.point(0, at.map(|x| x.min(1.0))).0;
        let expected = Sampler::density(&baseline, &w);
        for packed in &packed {
            let density = Sampler::density(packed, &w);
            assert!((density / expected - 1.0).abs() < 1e-3, "{w} {density} {expected}");
        }
    }
    for w in [
        DVec3::X,
        DVec3::NEG_X,
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
        DVec3::new(1.0, -1e-300, 0.0),
    ] {
        assert!(packed.iter().all(|packed| Sampler::density(packed, &w) > 0.0), "{w}");
    }
    assert!(Sampler::density(&packed[0], &DVec3::NAN).is_finite());
}

#[test]
fn packed_tables_are_small() {
    for (width, height) in [(512, 256), (500, 250), (1025, 512)] {
        let texels = width * height;
        for (form, most) in [(Form::Guide, 5), (Form::Alias, 8)] {
            let packed = PackedEnvironment::new(sky(width, height), RowWarp::UniformV, form).unwrap();
            let bytes = packed.table_bytes();
            assert!(bytes <= most * texels + 64 * (width + height), "{form:?}: {bytes} for {texels}");
        }
    }
}

#[test]
fn odd_maps_are_refused() {
    let black = RadianceMap::new(3, 2, vec![[0.0; 3]; 6]).unwrap();
    let wide = RadianceMap::new(65_537, 1, vec![[1.0; 3]; 65_537]).unwrap();
    for form in FORMS {
        let refused = PackedEnvironment::new(black.clone(), RowWarp::UniformV, form).map(|_| ());
        assert_eq!(refused, Err(Error::Black { width: 3, height: 2 }));
    }
    let refused = PackedEnvironment::new(wide.clone(), RowWarp::UniformV, Form::Guide).map(|_| ());
    assert!(matches!(refused, Err(Error::Parameter { parameter: "width of the map", .. })), "{refused:?}");
    assert!(PackedEnvironment::new(wide, RowWarp::UniformV, Form::Alias).is_ok());
}

#[test]
fn the_warp_without_its_branch_is_the_one_with_it() {
    let mut rng = stream(11, "xi", 0);
    let xi: Vec<Vec2> = (0..10_000)
        .map(|i| {
            let [a, b] = [0, 1].map(|_| unit_f64(&mut rng) as f32);
            if i % 7 == 0 { Vec2::splat(a) } else { Vec2::new(a, b) }
        })
        .collect();
    for warp in [TriangleWarp::LowDistortion, TriangleWarp::SquareRoot] {
        let mut all = vec![Vec3::ZERO; xi.len()];
        warp.barycentric_all(&xi, &mut all);
        for (&xi, &b) in xi.iter().zip(&all) {
            assert_eq!(b, warp.barycentric(xi));
            if warp == TriangleWarp::LowDistortion {
                let (b0, b1) = if xi.x < xi.y {
                    (0.5 * xi.x, xi.y - 0.5 * xi.x)
                } else {
                    (xi.x - 0.5 * xi.y, 0.5 * xi.y)
                };
                assert_eq!((b.x, b.y), (b0, b1), "{xi}");
            }
        }
    }
}

#[test]
fn the_battery_passes() {
    let settings = Settings { samples: 100_000, seed: 20_27, ..Settings::default() };
    let mut examinations = Vec::new();
    for (name, weights) in
        [("mesh", uneven(3000)), ("ragged", ragged(100_000, 5)), ("few", vec![1.0, 0.0, 1e-7, 2.0, 3.0, 0.5])]
    {
        for form in [Form::Guide, Form::Alias] {
            let table = DiscreteTable::new(&weights, form).unwrap();
            examinations
                .push(verify(&table).name(format!("{name} {form:?}")).settings(settings.clone()).examine());
        }
    }
    for rows in ROWS {
        for form in FORMS {
            let map = PackedEnvironment::new(sky(64, 32), rows, form).unwrap();
            examinations.push(
                verify(&map).name(format!("map {rows:?} {form:?}")).settings(settings.clone()).examine(),
            );
        }
    }
    Report::new(examinations, &settings).assert();
}

/// Extreme weights, each entry drawn where it says that it is.
#[cfg(feature = "render")]
#[test]
fn extreme_weights() {
    use warpcheck::stress;
    const STEP: f64 = 1.0 / 9_007_199_254_740_992.0;
    for form in [Form::Guide, Form::Alias] {
        let make = move |weights: &[f64]| DiscreteTable::new(weights, form);
        let rows = stress::discrete_rows(make, |entries, largest| (4.0 + entries * largest) * STEP);
        for (row, outcome) in stress::run(rows.into_iter().filter(|row| !row.heavy), |_| true) {
            assert!(outcome.is_ok(), "{form:?}, {}: {outcome:?}", row.input);
        }
    }
}

/// A scalar sampler's batch is what it draws one by one.
#[test]
fn the_default_batch_is_scalar() {
    let warp = BarycentricWarp::new(TriangleWarp::SquareRoot, 1.0).unwrap();
    let mut xi = vec![0.0; 200];
    fill_unit(&mut stream(12, "xi", 0), &mut xi);
    let mut samples = vec![None; 100];
    warp.fill(&xi, &mut samples);
    for (xi, sample) in xi.chunks(2).zip(samples) {
        assert_eq!(sample, Sampler::sample(&warp, xi));
    }
}

/// Points alone are those of the samples, to the last bit.
#[test]
fn points_alone_are_those_of_samples() {
    fn same<S: Sampler>(name: &str, sampler: &S, count: usize)
    where
        <S::Domain as Domain>::Point: PartialEq,
    {
        let mut xi = vec![0.0; count * sampler.dimensions()];
        fill_unit(&mut stream(13, name, 0), &mut xi);
        xi[0] = 0.0;
        xi[count - 1] = 1.0_f64.next_down();
        let (mut samples, mut points) = (vec![None; count], vec![None; count]);
        sampler.fill(&xi, &mut samples);
        (&sampler).fill_points(&xi, &mut points);
        for (sample, point) in samples.into_iter().zip(points) {
            assert_eq!(point, sample.map(|sample| sample.point), "{name}");
        }
    }
    for (name, weights) in kinds() {
        for form in [Form::Cdf, Form::Guide, Form::Alias] {
            same(name, &DiscreteTable::new(&weights, form).unwrap(), 1003);
        }
    }
    for rows in ROWS {
        for form in FORMS {
            for (width, height) in [(64, 32), (7, 3), (33, 5)] {
                let map = PackedEnvironment::new(sky(width, height), rows, form).unwrap();
                same(&format!("{rows:?} {form:?} {width}"), &map, 1003);
            }
        }
    }
    same("scalar", &BarycentricWarp::new(TriangleWarp::LowDistortion, 2.0).unwrap(), 100);
}

/// What a generator's numbers choose is what `indices` makes of them, in the caches and beyond.
#[test]
fn draws_are_the_indices_of_a_generators_numbers() {
    let large = ("large", uneven(100_000));
    for (name, weights) in kinds().into_iter().chain([large]) {
        let table = DiscreteAlias::new(&weights).unwrap();
        for count in [0, 1, 7, 8, 1003] {
            let (mut rng, mut drawn, mut same) = (stream(14, name, 0), vec![0; count], vec![0; count]);
            table.draw(&mut rng.clone(), &mut drawn);
            let bits: Vec<u64> = (0..count).map(|_| rng.next_u64()).collect();
            table.indices(&bits, &mut same);
            assert_eq!(drawn, same, "{name} {count}");
            for (bits, index) in bits.into_iter().zip(drawn) {
                let xi = (bits >> 11) as f64 / 9_007_199_254_740_992.0;
                assert_eq!(table.choose(xi).index, index as usize, "{name}");
            }
        }
    }
}

/// Pixels counted together are those of points one by one: some on borders, some none, some outside.
#[test]
fn points_counted_together_count_like_others() {
    let pixels = Pixels::new(640, 320);
    let mut rng = stream(16, "points", 0);
    for (outside, count) in [(0, 1000), (50, 1000), (2, 7)] {
        let points: Vec<Option<DVec3>> = (0..count)
            .map(|i| {
                let mut at = [unit_f64(&mut rng), unit_f64(&mut rng)];
                if i % 3 == 0 {
                    at = [(at[0] * 320.0).round() / 320.0, (at[1] * 640.0).round() / 640.0];
                }
                let scale = if outside > 0 && i % outside == 1 { 1.5 } else { 1.0 };
                (outside == 0 || i % 40 != 3).then(|| scale * Sphere.point(0, at).0)
            })
            .collect();
        let mut counts = vec![0; 640 * 320];
        let uncounted = Sphere.count_pixels(&pixels, &points, &mut counts);
        let (mut expected, mut without) = (vec![0; 640 * 320], Uncounted::default());
        for point in &points {
            match point.map(|w| Sphere.pixel(&pixels, &w)) {
                None => without.none += 1,
                Some(Err(_)) => without.outside += 1,
                Some(Ok(pixel)) => expected[pixel.unwrap()] += 1,
            }
        }
        assert!(counts == expected);
        assert_eq!(uncounted, without);
        assert_eq!(uncounted.outside > 0, outside > 0);
    }
}

/// Counts of many pixels, for which variates are sorted, are those of samples drawn one by one.
#[test]
fn sorted_variates_count_like_others() {
    let map = PackedEnvironment::new(sky(64, 32), RowWarp::UniformV, Form::Guide).unwrap();
    let settings = Settings { samples: 200_003, seed: 15, ..Settings::default() };
    let (width, height) = (768, 384);
    let histogram = Histogram::draw(&map, width, height, &settings);
    let (mut counts, pixels) = (vec![0; width * height], Pixels::new(width, height));
    for shard in 0..settings.samples.div_ceil(1 << 16) {
        let mut rng = stream(settings.seed, "histogram", shard);
        for _ in shard << 16..settings.samples.min((shard + 1) << 16) {
            let mut xi = [0.0; 2];
            fill_unit(&mut rng, &mut xi);
            let point = Sampler::sample(&map, &xi).unwrap().point;
            counts[Sphere.pixel(&pixels, &point).unwrap().unwrap()] += 1;
        }
    }
    assert_eq!(histogram.counts, counts);
    assert_eq!(histogram.samples, settings.samples);
}
