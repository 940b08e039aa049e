//! Samplers where the answer is known by hand: closed forms, tables of a few entries, how many bytes a table takes.

use glam::{DVec2, DVec3, Vec2, Vec3};
use rand::Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use warpcheck::domain::{Cell, Hemisphere, Knots, Mixed, Space, SurfacePoint};

use warpcheck::random::{stream, unit_f64};
use warpcheck::sampler::*;

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found}, not {expected}");
}

#[track_caller]
fn all_near(found: &[f64], expected: &[f64], off: f64) {
    let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= off);
    assert!(same, "{found:?}, not {expected:?}");
}

/// Ascending, each once.
fn sorted(mut knots: Vec<f64>) -> Vec<f64> {
    knots.sort_by(f64::total_cmp);
    knots.dedup();
    knots
}

fn patches(patches: std::ops::Range<usize>) -> Cell {
    Cell { patches, low: [0.0; 2], high: [1.0; 2] }
}

const FORMS: [Form; 3] = [Form::Cdf, Form::Guide, Form::Alias];

// ---- tables ----

/// Four equal entries have exactly a quarter of the steps each.
#[test]
fn a_table_of_quarters() {
    for form in FORMS {
        let table = DiscreteTable::new(&[3.0; 4], form).unwrap();
        assert_eq!((table.len(), table.is_empty(), table.form()), (4, false, form));
        assert_eq!([0, 1, 3, 4].map(|i| table.mass(i)), [0.25, 0.25, 0.25, 0.0]);
        assert_eq!([0, 1, 3, 4, 7].map(|i| table.cumulative(i)), [0.0, 0.25, 0.75, 1.0, 1.0]);
        assert_eq!(table.variate(2, 0.5), 0.625);
        assert_eq!(table.choose(0.3125), Choice { index: 1, mass: 0.25, rest: 0.25 });
        assert_eq!(sorted(table.variate_knots(0)), [0.25, 0.5, 0.75], "{form:?}");
        assert_eq!((table.dimensions(), table.domain().patches()), (1, 4));
        assert_eq!(table.left_over(&[0.875]), Some(0.5));
        assert_eq!(table.invert(&2), Some(vec![0.625]));
        assert_eq!(table.density(&1), 0.25);
        assert_eq!(table.cell_mass(&patches(1..4)), Some(0.75));
        // Of length 0 or 1, they have no borders.
        assert_eq!(DiscreteTable::new(&[2.0], form).unwrap().variate_knots(0), [0.0; 0]);
        assert_eq!(DiscreteTable::new(&[1.0, 0.0], form).unwrap().invert(&1), None);
    }
}

/// The light entry has a half of its cell, the heavy one the other half and its own cell.
#[test]
fn two_cells_of_an_alias_table() {
    let table = DiscreteAlias::new(&[3.0, 1.0]).unwrap();
    all_near(&sorted(table.variate_knots(0)), &[0.5, 0.75], 1e-15);
    for (xi, index, rest) in [(0.125, 0, 0.25), (0.5625, 1, 0.25), (0.9375, 0, 0.75)] {
        let choice = table.choose(xi);
        assert_eq!(choice.index, index);
        near(choice.rest, rest, 1e-14);
        let mut all = [Choice::default()];
        table.choose_all(&[xi], &mut all);
        assert_eq!(all[0], choice);
    }
    all_near(&[table.variate(0, 0.5), table.variate(1, 0.5)], &[0.25, 0.625], 1e-15);
    assert!(!table.is_empty());
    assert_eq!(table.len(), 2);
}

/// Some borders of many, from the first to the last.
#[test]
fn knots_are_spread_over_a_table() {
    let equal = |entries| DiscreteCdf::new(&vec![1.0; entries]).unwrap();
    all_near(&equal(2).variate_knots(0), &[0.5], 1e-15);
    all_near(&equal(3).variate_knots(0), &[1.0 / 3.0, 2.0 / 3.0], 1e-15);
    for entries in [513, 514, 1000] {
        let knots = equal(entries).variate_knots(0);
        let step = 1.0 / entries as f64;
        assert_eq!(knots.len(), 512);
        all_near(&[knots[0], knots[511]], &[step, 1.0 - step], 1e-15);
        let (least, most) =
            knots.windows(2).fold((1.0_f64, 0.0_f64), |(a, b), w| (a.min(w[1] - w[0]), b.max(w[1] - w[0])));
        assert!(least > 0.99 * step && most < 2.01 * step, "{entries}: {least} {most}");
    }
    // Both ends of every fourth of 1024 cells.
    let ends = (0..1024).step_by(4).flat_map(|cell| [cell, cell + 1]).filter(|&end| end > 0);
    let ends: Vec<f64> = ends.map(|end| f64::from(end) / 1024.0).collect();
    assert_eq!(sorted(DiscreteAlias::new(&[1.0; 1024]).unwrap().variate_knots(0)), ends);
}

#[test]
fn bytes_of_tables() {
    let bytes = |entries, form| DiscreteTable::new(&vec![1.0; entries], form).unwrap().bytes();
    assert_eq!([1, 4, 1000].map(|n| bytes(n, Form::Cdf)), [8, 32, 8000]);
    // Boundaries, and a power of two of buckets: one and a half times the entries, twice that up to 4096 of them, but at least two.
    assert_eq!(bytes(1, Form::Guide), 8 + 8 * 2);
    assert_eq!(bytes(4, Form::Guide), 8 * 4 + 8 * 16);
    assert_eq!(bytes(4096, Form::Guide), 8 * 4096 + 8 * 16_384);
    assert_eq!(bytes(4097, Form::Guide), 8 * 4097 + 8 * 8192);
    // Boundaries and cells; half cells from a megabyte of cells on.
    assert_eq!(bytes(1000, Form::Alias), 16 * 1000);
    assert_eq!(bytes((1 << 17) - 1, Form::Alias), 16 * ((1 << 17) - 1));
    assert_eq!(bytes(1 << 17, Form::Alias), 20 << 17);
}

/// Weights over six orders of magnitude, with zeros and runs of equal ones.
fn ragged(entries: usize) -> Vec<f64> {
    let mut rng = stream(22, "weights", 0);
    let mut draw = || unit_f64(&mut rng);
    (0..entries)
        .map(|i| {
            if i % 7 == 3 {
                0.0
            } else if i % 20 > 15 {
                1.0
            } else {
                10.0_f64.powf(6.0 * draw() - 3.0)
            }
        })
        .collect()
}

/// Between two borders all variates choose the same entry, and what an entry has of them adds up to its mass.
#[test]
fn parts_of_an_alias_table_add_up() {
    // The last: heavy ones that have to lend to each other.
    for weights in [ragged(5), ragged(100), ragged(256), vec![9.0, 8.0, 7.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]] {
        let table = DiscreteAlias::new(&weights).unwrap();
        let mut borders = sorted(table.variate_knots(0));
        borders.insert(0, 0.0);
        borders.push(1.0);
        let mut shares = vec![0.0; weights.len()];
        for part in borders.windows(2) {
            let entries =
                [part[0], 0.5 * (part[0] + part[1]), part[1].next_down()].map(|xi| table.choose(xi).index);
            assert_eq!(entries, [entries[0]; 3], "{part:?}");
            shares[entries[0]] += part[1] - part[0];
        }
        let masses: Vec<f64> = (0..weights.len()).map(|i| table.mass(i)).collect();
        all_near(&shares, &masses, 1e-14);
    }
}

/// From 2^17 entries on halves of cells answer, and where these don't tell, the cells: at the borders of parts and beside them.
#[test]
fn half_cells_answer_as_cells_do() {
    let table = DiscreteAlias::new(&ragged(1 << 17)).unwrap();
    let mut rng = stream(23, "bits", 0);
    let steps = table.variate_knots(0).into_iter().map(|xi| (xi * 2.0_f64.powi(53)) as u64);
    let mut bits: Vec<u64> =
        steps.flat_map(|step| [step - 1, step, step + 1].map(|step| step << 11)).collect();
    bits.extend((0..20_000).map(|_| rng.next_u64()));
    let mut found = vec![0; bits.len()];
    table.indices(&bits, &mut found);
    for (bits, index) in bits.into_iter().zip(found) {
        assert_eq!(table.choose((bits >> 11) as f64 / 2.0_f64.powi(53)).index, index as usize);
    }
}

/// Tables whose cells are made in several pieces: on a fine grid of variates every tenth of the entries has its mass.
#[test]
fn pieces_of_an_alias_table_fit_together() {
    // Two heavy entries with a piece without any between them.
    let mut far = vec![1e-6; 40_000];
    (far[7], far[39_990]) = (1.0, 2.0);
    for weights in [ragged(40_000), far] {
        let table = DiscreteAlias::new(&weights).unwrap();
        let (points, mut counts) = (1 << 18, vec![0; 40_000]);
        for k in 0..points {
            counts[table.choose((f64::from(k) + 0.5) / f64::from(points)).index] += 1;
        }
        // Each part of a cell is off by a point at most, to either side.
        for (tenth, counts) in counts.chunks(4000).enumerate() {
            let mass = table.cumulative(4000 * (tenth + 1)) - table.cumulative(4000 * tenth);
            all_near(&[f64::from(counts.iter().sum::<i32>()) / f64::from(points)], &[mass], 3e-3);
        }
    }
}

/// Masses to the step, so that the second entry lends all of its own cell: it lies in the parts of other cells.
#[test]
fn an_entry_without_a_part_of_its_own_cell() {
    // 2^53 = 5 k + 2, and the cells have k + 1, k, k + 1, k, k steps. The first lacks 5, the third all of its; the second has 6 too much.
    let k = ((1_u64 << 53) / 5) as f64;
    let masses = [k - 4.0, k + 6.0, 0.0, 2.0 * k, k];
    // A positive weight has one step on top.
    let table = DiscreteAlias::new(&masses.map(|m| (m - 1.0).max(0.0))).unwrap();
    assert_eq!([0, 1, 2, 3, 4].map(|i| table.mass(i) * 2.0_f64.powi(53)), masses);
    for i in [0, 1, 3, 4] {
        for rest in [0.0, 0.5, 1.0_f64.next_down()] {
            assert_eq!(table.choose(table.variate(i, rest)).index, i, "{rest}");
        }
    }
    assert!(table.variate(2, 0.5).is_nan());
}

/// A border belongs to the entry that begins there, and the step before it to the one that ends.
#[test]
fn borders_of_ordered_tables() {
    let mut crowd = vec![1e-9; 300];
    crowd[7] = 1.0;
    for weights in [ragged(5), ragged(300), crowd, vec![1.0; 64]] {
        for form in [Form::Cdf, Form::Guide] {
            let table = DiscreteTable::new(&weights, form).unwrap();
            for (i, _) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                let (start, end) = (table.cumulative(i), table.cumulative(i + 1));
                let steps = [start, 0.5 * (start + end), end - 2.0_f64.powi(-53)];
                assert_eq!(steps.map(|xi| table.choose(xi).index), [i; 3], "{form:?} {i}");
                let bits = steps.map(|xi| ((xi * 2.0_f64.powi(53)) as u64) << 11);
                let mut found = [0; 3];
                table.indices(&bits, &mut found);
                assert_eq!(found, [i as u32; 3], "{form:?} {i}");
            }
        }
    }
}

#[test]
fn weights_at_the_ends_of_f64() {
    let masses = |weights: &[f64]| -> Vec<f64> {
        let table = DiscreteCdf::new(weights).unwrap();
        (0..weights.len()).map(|i| table.mass(i)).collect()
    };
    all_near(&masses(&[f64::MAX; 8]), &[0.125; 8], 1e-15);
    all_near(&masses(&[f64::MAX, f64::MAX / 2.0, f64::MAX / 2.0]), &[0.5, 0.25, 0.25], 1e-15);
    all_near(&masses(&[5e-324, 1e-323]), &[1.0 / 3.0, 2.0 / 3.0], 1e-15);
    all_near(&masses(&[f64::MIN_POSITIVE, 3.0 * f64::MIN_POSITIVE]), &[0.25, 0.75], 1e-15);
    // 4096 times half a unit of 2^-53 is lost one by one, and is 2048 units together; each has one more to be drawn with.
    let mut small = vec![2.0_f64.powi(-54); 4097];
    small[0] = 1.0;
    let left = (1.0 - masses(&small)[0]) * 2.0_f64.powi(53);
    assert!((left - (4096.0 + 2048.0)).abs() <= 2.0, "{left}");
}

// ---- maps ----

/// Four columns, the rows 1 1 1 1 and 1 2 3 2: the lower has two thirds of the light.
fn small_map() -> RadianceMap {
    let texels = [1, 1, 1, 1, 1, 2, 3, 2].map(|x| [x as f32; 3]);
    RadianceMap::new(4, 2, texels.to_vec()).unwrap()
}

#[test]
fn a_map_of_eight_texels() {
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let map = Environment::from_map(small_map(), rows).unwrap();
        let packed =
            [Form::Guide, Form::Alias].map(|form| PackedEnvironment::new(small_map(), rows, form).unwrap());
        assert_eq!((map.width(), map.height(), map.map().constant()), (4, 2, None));
        assert_eq!(packed.each_ref().map(PackedEnvironment::form), [Form::Guide, Form::Alias]);
        assert_eq!(map.texel(2, 1), [3.0; 3]);
        near(map.texel_mass(2, 1), 0.25, 1e-14);
        assert!(packed.iter().all(|map| (map.texel_mass(2, 1) - 0.25).abs() < 1e-9));
        for knots in [map.knots(), packed[0].knots(), packed[1].knots()] {
            assert_eq!(knots, Knots::grid(2, 4));
        }
        // Rows, and columns of the brighter one.
        for knots in
            [&|d| map.variate_knots(d), &|d| packed[0].variate_knots(d)] as [&dyn Fn(usize) -> Vec<f64>; 2]
        {
            all_near(&knots(0), &[1.0 / 3.0], 1e-9);
            all_near(&knots(1), &[0.125, 0.375, 0.75], 1e-9);
        }
        assert_eq!(packed[1].variate_knots(1), [0.0; 0]);
        assert!(packed[1].variate_knots(0).len() > 8);
        all_near(&map.marginal().variate_knots(0), &[1.0 / 3.0], 1e-15);
        all_near(&map.conditional(0).unwrap().variate_knots(0), &[0.25, 0.5, 0.75], 1e-15);
        // The middle of column 2 of the lower row, which has 2/3 of the first variate and 3/8 of the second.
        let xi = [2.0 / 3.0, 0.5625];
        let theta = match rows {
            RowWarp::UniformV => 0.75 * PI,
            RowWarp::UniformCosTheta => 2.0 / 3.0 * PI,
        };
        let density = match rows {
            RowWarp::UniformV => 0.25 * 8.0 / (2.0 * PI * PI * theta.sin()),
            RowWarp::UniformCosTheta => 0.25 / (PI / 2.0),
        };
        let direction =
            DVec3::new(theta.sin() * (1.25 * PI).cos(), theta.sin() * (1.25 * PI).sin(), theta.cos());
        for sample in [map.sample(xi), packed[0].sample(xi)] {
            all_near(&sample.uv.to_array(), &[0.625, theta / PI], 1e-8);
            assert!((sample.direction.as_dvec3() - direction).length() < 1e-7, "{sample:?}");
            near(sample.density.into(), density, 1e-6);
            assert_eq!(sample.radiance, Vec3::splat(3.0));
        }
        for found in [
            map.density(direction.as_vec3()),
            packed[0].density(direction.as_vec3()),
            packed[1].density(direction.as_vec3()),
        ] {
            near(found.into(), density, 1e-6);
        }
        // Per (u, v), per v and per u.
        let v = theta / PI;
        near(map.density_uv(DVec2::new(0.625, v)), density * TAU * PI * theta.sin(), 1e-12);
        near(map.density_u(0.625, v).unwrap(), 1.5, 1e-12);
        near(map.density_v(v), density * TAU * PI * theta.sin() / 1.5, 1e-12);
        // The last row and column have their ends.
        near(map.density_u(1.0, 1.0).unwrap(), 1.0, 1e-12);
        near(map.density_uv(DVec2::new(1.0, 0.75)), map.density_uv(DVec2::new(0.9, 0.75)), 1e-12);
        if rows == RowWarp::UniformV {
            near(map.density_v(1.0), 4.0 / 3.0, 1e-12);
        }
    }
}

/// Seven rows, seen from the nearer pole: the place in a row is linear in v, or in cos theta.
#[test]
fn places_in_rows() {
    let map = |rows| Environment::new(1, 7, vec![[1.0; 3]; 7], rows).unwrap();
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let baseline = map(rows);
        let packed = PackedEnvironment::new(baseline.map().clone(), rows, Form::Guide).unwrap();
        for row in 0..7 {
            for place in [1e-9, 0.25, 0.5, 0.9, 1.0 - 1e-9] {
                let marginal = baseline.marginal();
                let xi = marginal.cumulative(row) + place * marginal.mass(row);
                let [top, bottom] = [row, row + 1].map(|edge| edge as f64 / 7.0 * PI);
                let theta = match rows {
                    RowWarp::UniformV => top + place * (bottom - top),
                    RowWarp::UniformCosTheta => (top.cos() + place * (bottom.cos() - top.cos())).acos(),
                };
                for sample in [baseline.sample([xi, 0.3]), packed.sample([xi, 0.3])] {
                    // Off the borders by 2e-7.
                    let theta = theta.clamp(top + 2e-7, bottom - 2e-7);
                    all_near(&[PI * sample.uv.y], &[theta], 1e-8);
                    let density = match rows {
                        RowWarp::UniformV => {
                            7.0 * baseline.texel_mass(0, row) / (2.0 * PI * PI * theta.sin())
                        }
                        RowWarp::UniformCosTheta => 1.0 / (4.0 * PI),
                    };
                    near(sample.density.into(), density, 1e-6);
                    all_near(&[sample.direction.z.into()], &[theta.cos()], 1e-7);
                    all_near(&[sample.direction.truncate().length().into()], &[theta.sin()], 1e-7);
                }
            }
        }
    }
}

#[test]
fn maps_of_one_colour_and_of_two() {
    let of = |texels: Vec<[f32; 3]>| RadianceMap::new(texels.len(), 1, texels).unwrap();
    assert_eq!(of(vec![[1.0, 2.0, 3.0]; 5]).constant(), Some(Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!(of(vec![[1.0, 2.0, 3.0], [1.0, 2.0, 3.5]]).constant(), None);
    near(luminance([1.0, 0.0, 0.0]), 0.2126, 1e-15);
    near(luminance([0.0, 2.0, 0.0]), 2.0 * 0.7152, 1e-15);
    near(luminance([0.0, 0.0, 4.0]), 4.0 * 0.0722, 1e-15);
    let dark = RadianceMap::new(1, 2, vec![[0.0; 3], [1.0; 3]]).unwrap();
    let dark = Environment::from_map(dark, RowWarp::UniformV).unwrap();
    assert!(dark.conditional(0).is_none() && dark.conditional(1).is_some());
    assert_eq!((dark.density_u(0.5, 0.2), dark.texel_mass(0, 0), dark.texel_mass(0, 1)), (None, 0.0, 1.0));
    assert_eq!((dark.radiance(Vec3::Z), dark.radiance(Vec3::NEG_Z)), (Vec3::ZERO, Vec3::ONE));
    // phi = 0 is the start of the first column, and an ulp before it the end of the last.
    let columns = of((0..4).map(|i| [i as f32; 3]).collect());
    for (w, column) in [
        (Vec3::X, 0.0),
        (Vec3::new(1.0, 1e-30, 0.0), 0.0),
        (Vec3::new(1.0, -1e-30, 0.0), 3.0),
        (Vec3::Y, 1.0),
        (Vec3::NEG_Y, 3.0),
    ] {
        assert_eq!(columns.radiance(w), Vec3::splat(column), "{w}");
    }
}

/// Samples keep 2e-7 rad off the borders of columns.
#[test]
fn margins_of_columns() {
    let map = RadianceMap::new(1000, 1, vec![[1.0; 3]; 1000]).unwrap();
    let baseline = Environment::from_map(map.clone(), RowWarp::UniformV).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformV, Form::Guide).unwrap();
    for column in [0, 1, 500, 999] {
        let border = f64::from(column) / 1000.0;
        for (xi, expected) in
            [(border + 1e-9, border + 2e-7 / TAU), (border + 1e-3 - 1e-9, border + 1e-3 - 2e-7 / TAU)]
        {
            all_near(
                &[baseline.sample([0.5, xi]).uv.x, packed.sample([0.5, xi]).uv.x],
                &[expected; 2],
                1e-10,
            );
        }
    }
}

/// The masses of texels are whole numbers of 2^-53, and use up all of it.
#[test]
fn masses_of_an_alias_map_fill_it() {
    let texels: Vec<[f32; 3]> =
        (0..7 * 5).map(|i| if i % 4 == 1 { [0.0; 3] } else { [(i as f32 * 0.7).sin().abs(); 3] }).collect();
    let map = RadianceMap::new(7, 5, texels).unwrap();
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let packed = PackedEnvironment::new(map.clone(), rows, Form::Alias).unwrap();
        let steps = (0..35).map(|i| packed.texel_mass(i % 7, i / 7) * 2.0_f64.powi(53));
        let total: u64 = steps.map(|steps| steps as u64).sum();
        assert_eq!(total, 1 << 53);
    }
}

/// Texels of an alias map get as many variates as their mass says, evenly spread over their width.
#[test]
fn an_alias_map_draws_its_masses() {
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let packed = PackedEnvironment::new(small_map(), rows, Form::Alias).unwrap();
        let (points, mut counts, mut places) = (4096, [0.0; 8], [0.0; 8]);
        for k in 0..points {
            let [u, v] = packed.sample([(f64::from(k) + 0.5) / f64::from(points), 0.25]).uv.to_array();
            let texel = (4.0 * u) as usize + 4 * (2.0 * v) as usize;
            counts[texel] += 1.0;
            places[texel] += (4.0 * u).fract();
        }
        for (i, (count, place)) in counts.into_iter().zip(places).enumerate() {
            all_near(&[count / f64::from(points)], &[packed.texel_mass(i % 4, i / 4)], 2e-3);
            all_near(&[place / count], &[0.5], 0.01);
        }
    }
}

/// A texel of one of the 2^31 steps that a row has: samples are spread over all of its width. The texel of no light is no border.
#[test]
fn a_texel_of_one_step() {
    let texels = [0.0, 1.0, 1e-12].map(|x| [x; 3]);
    let map = RadianceMap::new(3, 1, texels.to_vec()).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformV, Form::Guide).unwrap();
    let step = 2.0_f64.powi(-31);
    near(packed.texel_mass(2, 0), step, 1e-12);
    for part in [0.25, 0.5, 0.75] {
        let u = packed.sample([0.5, 1.0 - step + part * step]).uv.x;
        all_near(&[u], &[(2.0 + part) / 3.0], 1e-6);
    }
    all_near(&[packed.sample([0.5, 0.5]).uv.x], &[0.5], 1e-9);
    assert_eq!(packed.variate_knots(1), [1.0 - step]);
    // Where others follow, too.
    let texels = [1.0, 1e-12, 1e-12, 1.0].map(|x| [x; 3]);
    let map = RadianceMap::new(4, 1, texels.to_vec()).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformV, Form::Guide).unwrap();
    assert_eq!([packed.texel_mass(1, 0), packed.texel_mass(2, 0)], [step; 2]);
    all_near(&DiscreteCdf::new(&[0.0, 1.0, 1.0]).unwrap().variate_knots(0), &[0.5], 1e-15);
}

/// 2^16 columns are the most that guides have place for.
#[test]
fn the_widest_map_with_guides() {
    let map = RadianceMap::new(1 << 16, 1, vec![[1.0; 3]; 1 << 16]).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformCosTheta, Form::Guide).unwrap();
    for column in [0, 1, 40_000, 65_535] {
        assert_eq!(packed.texel_mass(column, 0), 1.0 / 65_536.0);
        let u = packed.sample([0.5, (column as f64 + 0.5) / 65_536.0]).uv.x;
        assert_eq!((u * 65_536.0) as usize, column);
    }
}

/// Texels and what they take; 16 bytes for each border of rows and columns.
#[test]
fn bytes_of_maps() {
    let (width, height) = (512, 8);
    let map = RadianceMap::new(width, height, vec![[1.0; 3]; width * height]).unwrap();
    let bytes = |rows, form| PackedEnvironment::new(map.clone(), rows, form).unwrap().table_bytes();
    let beside = 16 * (width + 1 + height + 1) + 8 * height;
    assert_eq!(bytes(RowWarp::UniformV, Form::Alias), 8 * width * height + beside);
    // A guide over the rows; 4 bytes a texel, 2 for each line of 16, 16 for the last of 32 lines.
    let guide = 8 * height + 8 * 32;
    assert_eq!(bytes(RowWarp::UniformV, Form::Guide), guide + height * (4 * width + 2 * 32 + 16) + beside);
    for form in [Form::Guide, Form::Alias] {
        assert!(bytes(RowWarp::UniformCosTheta, form) >= bytes(RowWarp::UniformV, form) + 33 * height);
    }
    // Boundaries of rows and columns, and where they are.
    let baseline = Environment::from_map(map.clone(), RowWarp::UniformV).unwrap().table_bytes();
    let boundaries = 8 * width * height + 8 * height;
    assert!(baseline >= boundaries + 16 * height && baseline <= boundaries + 32 * height, "{baseline}");
}

#[test]
fn directions_of_uv() {
    for (u, v) in [(0.1, 0.2), (0.6, 0.7), (0.9, 0.01)] {
        let ((sin_phi, cos_phi), (sine, cosine)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
        let expected = DVec3::new(sine * cos_phi, sine * sin_phi, cosine);
        let found = PackedEnvironment::direction_of([u, v]).as_dvec3();
        assert!((found - expected).length() < 1e-7, "{found} {expected}");
    }
}

// ---- triangles ----

#[test]
fn warps_of_a_triangle_by_hand() {
    for (warp, xi, b) in [
        (TriangleWarp::LowDistortion, Vec2::new(0.25, 0.75), Vec3::new(0.125, 0.625, 0.25)),
        (TriangleWarp::LowDistortion, Vec2::new(0.75, 0.25), Vec3::new(0.625, 0.125, 0.25)),
        (TriangleWarp::LowDistortion, Vec2::new(0.5, 0.5), Vec3::new(0.25, 0.25, 0.5)),
        (TriangleWarp::SquareRoot, Vec2::new(0.25, 0.75), Vec3::new(0.5, 0.375, 0.125)),
        (TriangleWarp::SquareRoot, Vec2::new(0.0, 0.0), Vec3::X),
    ] {
        assert_eq!((warp.barycentric(xi), warp.invert(b)), (b, xi), "{warp:?}");
        let mut all = [Vec3::ZERO; 2];
        warp.barycentric_all(&[xi, xi], &mut all);
        assert_eq!(all, [b; 2]);
    }
}

// ---- directions ----

#[test]
fn uniform_directions_by_hand() {
    // z = 1 - xi0, 1 - 2 xi0 or sqrt(1 - xi0); a twelfth of a turn.
    let (half, turned) =
        (Vec2::new(0.5, 1.0 / 12.0), |r: f32, z: f32| Vec3::new(r * 0.75_f32.sqrt(), r * 0.5, z));
    assert!((UniformHemisphere.sample(half) - turned(0.75_f32.sqrt(), 0.5)).length() < 1e-6);
    let low = UniformSphere.sample(Vec2::new(0.75, 1.0 / 12.0));
    assert!((low - turned(0.75_f32.sqrt(), -0.5)).length() < 1e-6);
    assert!((CosineHemisphere.sample(half) - turned(0.5_f32.sqrt(), 0.5_f32.sqrt())).length() < 1e-6);
    let below = Vec3::new(0.6, 0.0, -0.8);
    near(UniformSphere.density(below).into(), 0.25 / PI, 1e-6);
    near(UniformHemisphere.density(-below).into(), 0.5 / PI, 1e-6);
    near(UniformHemisphere.density(Vec3::X).into(), 0.5 / PI, 1e-6);
    near(CosineHemisphere.density(-below).into(), 0.8 / PI, 1e-6);
    assert_eq!((UniformHemisphere.density(below), CosineHemisphere.density(below)), (0.0, 0.0));
    // Three quarters of a turn.
    let w = DVec3::new(0.0, -0.6, 0.8);
    all_near(&UniformHemisphere.invert(&w).unwrap(), &[0.2, 0.75], 1e-12);
    all_near(&UniformSphere.invert(&w).unwrap(), &[0.1, 0.75], 1e-12);
    all_near(&UniformSphere.invert(&-w).unwrap(), &[0.9, 0.25], 1e-12);
    all_near(&CosineHemisphere.invert(&w).unwrap(), &[0.36, 0.75], 1e-12);
    let oblique = DVec3::new(0.48, -0.36, 0.8);
    all_near(&UniformHemisphere.invert(&oblique).unwrap()[..1], &[0.2], 1e-12);
    all_near(&UniformSphere.invert(&-oblique).unwrap()[..1], &[0.9], 1e-12);
    all_near(&CosineHemisphere.invert(&oblique).unwrap()[..1], &[0.36], 1e-12);
    // Beside the pole, where 1 - z has no digits.
    let beside = DVec3::new(6e-6, 8e-6, (1.0 - 1e-10_f64).sqrt());
    near(UniformHemisphere.invert(&beside).unwrap()[0], 5e-11, 1e-9);
    near(UniformSphere.invert(&beside).unwrap()[0], 2.5e-11, 1e-9);
    assert_eq!(CosineHemisphere.invert(&DVec3::X).unwrap()[1], 0.0);
    // An ulp below a whole turn, not one.
    let turn = CosineHemisphere.invert(&DVec3::new(1.0, -1e-300, 0.0)).unwrap()[1];
    assert!(turn < 1.0 && turn > 0.999, "{turn}");
}

/// Phong's lobe of exponent 3, on the axis: cos alpha = xi^(1/4), density 4 / 2 pi cos^3 alpha.
#[test]
fn a_phong_lobe_by_hand() {
    let lobe = PhongLobe::new(Vec3::Z, 3.0).unwrap();
    let w = lobe.sample(Vec2::new(1.0 / 16.0, 0.25)).unwrap();
    assert!((w - Vec3::new(0.0, 0.75_f32.sqrt(), 0.5)).length() < 1e-6, "{w}");
    near(lobe.density(w).into(), 2.0 / PI * 0.125, 1e-6);
    near(lobe.density(Vec3::Z).into(), 2.0 / PI, 1e-6);
    near(lobe.density(Vec3::new(0.28, 0.0, 0.96)).into(), 2.0 / PI * 0.96_f64.powi(3), 1e-6);
    assert_eq!(lobe.density(Vec3::new(0.6, 0.0, -0.8)), 0.0);
    // About X half of it is under the surface.
    let grazing = PhongLobe::new(Vec3::X, 1.0).unwrap();
    assert_eq!(
        [0.25, 0.75]
            .map(|turn| grazing.sample(Vec2::new(0.25, turn)).is_some())
            .iter()
            .filter(|s| **s)
            .count(),
        1
    );
    near(grazing.density(Vec3::new(0.6, 0.0, 0.8)).into(), 0.6 / PI, 1e-6);
    assert_eq!(grazing.density(Vec3::new(-0.6, 0.0, 0.8)), 0.0);
    assert_eq!(grazing.density(Vec3::new(0.8, 0.0, -0.6)), 0.0);
    // Near the mirror direction the cosine has no digits in `f32`, the chord has.
    let (narrow, w) = (PhongLobe::new(Vec3::Z, 1e6).unwrap(), Vec3::new(1e-3, 0.0, 1.0));
    near(narrow.density(w).into(), 1e6 / TAU * (1e6 * (-0.5e-6_f64).ln_1p()).exp(), 1e-5);
    let sharpest = |exponent| PhongLobe::new(Vec3::Z, exponent).unwrap();
    assert_eq!(sharpest(1e30), sharpest(PhongLobe::LARGEST_EXPONENT));
    assert_ne!(sharpest(1e8), sharpest(PhongLobe::LARGEST_EXPONENT));
}

/// kappa = 2: density 2 / (2 pi (1 - e^-4)) e^-2(1 - cos alpha).
#[test]
fn a_von_mises_fisher_lobe_by_hand() {
    let lobe = VonMisesFisher::new(Vec3::Z, 2.0).unwrap();
    let top = 2.0 / (TAU * (1.0 - (-4.0_f64).exp()));
    near(lobe.density(Vec3::Z).into(), top, 1e-6);
    near(lobe.density(Vec3::Y).into(), top * (-2.0_f64).exp(), 1e-6);
    near(lobe.density(Vec3::NEG_Z).into(), top * (-4.0_f64).exp(), 1e-6);
    // The share of the cap with cos alpha >= 1/2 is (1 - e^-1) / (1 - e^-4).
    let share = (1.0 - (-1.0_f32).exp()) / (1.0 - (-4.0_f32).exp());
    let expected = Vec3::new(0.75, 0.5 * 0.75_f32.sqrt(), 0.5);
    assert!((lobe.sample(Vec2::new(share, 1.0 / 12.0)) - expected).length() < 1e-6);
    assert!((lobe.sample(Vec2::new(0.0, 0.25)) - Vec3::Z).length() < 1e-6);
    // At kappa 1e4 e^-2e4 is nothing.
    let narrow = VonMisesFisher::new(Vec3::Z, 1e4).unwrap();
    near(narrow.density(Vec3::Z).into(), 1e4 / TAU, 1e-6);
}

/// D, G1 and the height-correlated G2 as Heitz (2014) has them, in `f64`.
#[test]
fn ggx_by_hand() {
    for (outgoing, alpha) in
        [(Vec3::Z, 1.0), (Vec3::new(0.6, 0.0, 0.8), 0.5), (Vec3::new(-0.48, 0.64, 0.6), 0.1)]
    {
        let lobe = GgxVisibleNormals::new(outgoing, alpha).unwrap();
        let (a, o) = (f64::from(alpha), outgoing.as_dvec3());
        let lambda = |w: DVec3| {
            let tangent = w.truncate().length_squared() / (w.z * w.z);
            0.5 * ((1.0 + a * a * tangent).sqrt() - 1.0)
        };
        for w in [
            Vec3::new(0.0, 0.0, 1.0),
            Vec3::new(-0.6, 0.0, 0.8),
            Vec3::new(0.36, -0.48, 0.8),
            Vec3::new(0.96, 0.0, 0.28),
        ] {
            let i = w.as_dvec3();
            let m = (i + o).normalize();
            let d = 1.0 / (PI * a * a * (m.truncate().length_squared() / (a * a) + m.z * m.z).powi(2));
            let density = d / ((1.0 + lambda(o)) * 4.0 * o.z);
            let brdf = d / ((1.0 + lambda(o) + lambda(i)) * 4.0 * o.z * i.z);
            near(lobe.density(w).into(), density, 1e-4);
            near((lobe.density(w) * lobe.brdf_over_density(w)).into(), brdf, 1e-4);
            assert_eq!(
                (
                    lobe.density(w * Vec3::new(1.0, 1.0, -1.0)),
                    lobe.brdf_over_density(w * Vec3::new(1.0, 1.0, -1.0))
                ),
                (0.0, 0.0)
            );
        }
        // The pole of the cap: the stretched direction and Z, added and stretched back.
        let stretched = DVec3::new(a * o.x, a * o.y, o.z).normalize();
        let expected = DVec3::new(a * stretched.x, a * stretched.y, 1.0 + stretched.z).normalize();
        assert!((lobe.normal(Vec2::new(0.3, 0.0)).as_dvec3() - expected).length() < 1e-6);
        // Halfway down the cap, a twelfth of a turn.
        let drop = 0.5 * (1.0 + stretched.z);
        let r = (drop * (2.0 - drop)).sqrt();
        let (x, y) = (r * 0.75_f64.sqrt() + stretched.x, 0.5 * r + stretched.y);
        let expected = DVec3::new(a * x, a * y, 1.0 - drop + stretched.z).normalize();
        let m = lobe.normal(Vec2::new(1.0 / 12.0, 0.5)).as_dvec3();
        assert!((m - expected).length() < 1e-6, "{m} {expected}");
        let reflected = 2.0 * o.dot(expected) * expected - o;
        let w = lobe.sample(Vec2::new(1.0 / 12.0, 0.5)).map(|w| w.as_dvec3());
        assert!(
            if reflected.z > 0.0 { w.unwrap().distance(reflected) < 1e-5 } else { w.is_none() },
            "{w:?} {reflected}"
        );
    }
}

/// An octant: the first variate is the angle about Y, the second what 1 - y is.
#[test]
fn an_octant_by_hand() {
    let octant =
        SphericalTriangle::new(Vec3::ONE, [Vec3::X, Vec3::Y, Vec3::Z].map(|v| v * 3.0 + Vec3::ONE)).unwrap();
    near(octant.solid_angle(), FRAC_PI_2, 1e-15);
    for (a, b) in [(0.0, 0.5), (0.3, 0.6), (0.7, 0.1), (0.999, 0.999)] {
        let ((sin, cos), y) = ((FRAC_PI_2 * a).sin_cos(), 1.0 - b);
        let r = (1.0_f64 - y * y).sqrt();
        let w = octant.sample([a, b]);
        assert!((w - DVec3::new(r * cos, y, r * sin)).length() < 1e-14, "{a} {b}: {w}");
        near(octant.density(w), 1.0 / FRAC_PI_2, 1e-15);
    }
    let inside = DVec3::new(0.1, 0.2, 0.3).normalize();
    for flip in
        [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0), DVec3::NEG_ONE]
    {
        assert_eq!(octant.density(inside * flip), 0.0);
    }
    // The other way round.
    let other = SphericalTriangle::new(Vec3::ZERO, [Vec3::Z, Vec3::Y, Vec3::X]).unwrap();
    near(other.density(inside), 1.0 / FRAC_PI_2, 1e-15);
    let ((sin, cos), w) = ((FRAC_PI_2 * 0.3).sin_cos(), other.sample([0.3, 1.0]));
    assert!((w - DVec3::new(sin, 0.0, cos)).length() < 1e-14, "{w}");
}

/// Seen from its own plane a triangle has no solid angle: from beside, on an edge, in a corner and from within.
#[test]
fn triangles_seen_from_their_plane() {
    let corners = [Vec3::X, Vec3::new(-0.5, 0.75, 0.0), Vec3::new(-0.5, -0.75, 0.0)];
    for x in
        [Vec3::ZERO, Vec3::new(0.1, 0.2, 0.0), Vec3::new(-0.5, 0.0, 0.0), Vec3::X, Vec3::new(5.0, 0.0, 0.0)]
    {
        assert!(SphericalTriangle::new(x, corners).is_none(), "{x}");
    }
    // From just above its middle it is half of all directions.
    let above = SphericalTriangle::new(Vec3::Z * 1e-6, corners).unwrap();
    near(above.solid_angle(), TAU, 1e-5);
}

/// From (0, 0, 0) to (0, 3, 4), whose normal is -Z: distance 5, cosine 4/5.
#[test]
fn a_view_by_hand() {
    let view = View::new(Vec3::X, Vec3::new(1.0, 3.0, 4.0), Vec3::NEG_Z).unwrap();
    assert_eq!((view.distance_squared, view.cosine), (25.0, 0.8));
    assert!((view.direction - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-15);
    near(view.per_solid_angle(2.0), 2.0 * 25.0 / 0.8, 1e-15);
    near(view.per_area(2.0), 2.0 * 0.8 / 25.0, 1e-15);
    assert_eq!(View::along(DVec3::new(0.0, 3.0, 4.0), Vec3::NEG_Z), Some(view));
    let behind = View::along(DVec3::new(0.0, 3.0, 4.0), Vec3::Z).unwrap();
    assert_eq!((behind.cosine, behind.per_solid_angle(2.0), behind.per_area(2.0)), (-0.8, 0.0, 0.0));
    assert_eq!(behind.two_sided(), view);
    let edge_on = View::along(DVec3::Y, Vec3::Z).unwrap();
    assert_eq!((edge_on.per_solid_angle(2.0), edge_on.per_area(2.0)), (0.0, 0.0));
    assert_eq!(View::new(Vec3::X, Vec3::X, Vec3::Z), None);
}

/// Half a face of a cube has a twelfth of the sphere. With a second variate of 1 samples lie on the arc from a to c, which the first cuts by area.
#[test]
fn shares_of_a_spherical_triangle() {
    let corners = [Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(1.0, 1.0, 1.0)];
    let whole = SphericalTriangle::new(Vec3::ZERO, corners).unwrap();
    near(whole.solid_angle(), 4.0 * PI / 12.0, 1e-14);
    for share in [0.1, 0.5, 0.8] {
        let on_arc = whole.sample([share, 1.0]);
        let part = SphericalTriangle::new(Vec3::ZERO, [corners[0], corners[1], on_arc.as_vec3()]).unwrap();
        near(part.solid_angle(), share * whole.solid_angle(), 1e-6);
        assert!((on_arc.x - on_arc.y).abs() < 1e-14, "{on_arc}"); // the plane of a and c
        // And the second cuts the cosine with b.
        let b = corners[1].as_dvec3().normalize();
        near(1.0 - whole.sample([share, 0.25]).dot(b), 0.25 * (1.0 - on_arc.dot(b)), 1e-12);
    }
}

// ---- lights ----

/// Four lights in a row along each axis, given in another order, from beside and from within: the boxes are known.
#[test]
fn a_tree_of_four_lights() {
    let order = [2, 0, 3, 1];
    let powers = [1.0, 2.0, 4.0, 3.0];
    for axis in 0..3 {
        // From corner to corner of a box of 0.2 x 0.1 x 0.1, the first along the axis, on which the origin lies between them.
        let across = DVec3::ONE - DVec3::AXES[axis];
        let away = 10.0 * across;
        let light = |k: usize| {
            let low = DVec3::AXES[axis] * (k as f64 - 2.0) + away;
            let high = low + DVec3::splat(0.1) + 0.1 * DVec3::AXES[axis];
            ([low.as_vec3(), high.as_vec3(), low.as_vec3()], powers[k])
        };
        let tree = LightTree::new(order.map(light)).unwrap();
        assert_eq!((tree.len(), tree.is_empty()), (4, false));
        let weight = |x: Vec3, from: usize, to: usize| {
            let (low, high) = (from as f64 - 2.0, to as f64 - 2.8);
            let centre = 0.5 * (low + high) * DVec3::AXES[axis] + 0.05 * across + away;
            let radius = 0.25 * ((high - low).powi(2) + 2.0 * 0.01);
            powers[from..to].iter().sum::<f64>() / centre.distance_squared(x.as_dvec3()).max(radius)
        };
        for x in [Vec3::new(0.3, -0.7, 1.1), Vec3::AXES[axis] * 0.4, Vec3::AXES[axis] * 3.1, Vec3::NEG_ONE] {
            let x = x + away.as_vec3();
            let to_left = |from, middle, to| {
                weight(x, from, middle) / (weight(x, from, middle) + weight(x, middle, to))
            };
            let (root, left, right) = (to_left(0, 2, 4), to_left(0, 1, 2), to_left(2, 3, 4));
            let expected =
                [root * left, root * (1.0 - left), (1.0 - root) * right, (1.0 - root) * (1.0 - right)];
            let mut start = 0.0;
            for (k, mass) in expected.into_iter().enumerate() {
                let given = order.iter().position(|&o| o == k).unwrap();
                near(tree.mass(x, given), mass, 1e-5);
                for part in [0.001, 0.5, 0.999] {
                    let (light, found) = tree.choose(x, start + part * mass);
                    assert_eq!(light, given, "axis {axis}, {x}, {k}");
                    near(found, mass, 1e-5);
                }
                start += mass;
            }
            assert_eq!(tree.mass(x, 4), 0.0);
        }
        // Seven nodes of 40 bytes, and two numbers a light.
        assert_eq!(tree.bytes(), 7 * 40 + 4 * 8);
    }
}

/// Two lights alike, from between them: a half each, the border itself to the second.
#[test]
fn the_border_between_two_lights() {
    let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
    let tree = LightTree::new([(at(-1.0), 2.0), (at(1.0), 2.0)]).unwrap();
    for (xi, light) in [(0.0, 0), (0.5_f64.next_down(), 0), (0.5, 1), (1.0_f64.next_down(), 1)] {
        assert_eq!(tree.choose(Vec3::ZERO, xi), (light, 0.5), "{xi}");
    }
}

/// Powers whose products are no numbers.
#[test]
fn lights_of_enormous_power() {
    let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
    let tree = LightTree::new([(at(-1.0), 1e300), (at(1.0), 3e300)]).unwrap();
    near(tree.mass(Vec3::ZERO, 1), 0.75, 1e-12);
}

/// Triangles all round, hit by a ray as Moeller and Trumbore have it: the density of a direction sums over all that it meets.
#[test]
fn densities_of_directions_sum_over_all_hits() {
    let mut rng = stream(21, "hits", 0);
    let mut draw = || DVec3::from_array([(); 3].map(|()| 2.0 * unit_f64(&mut rng) - 1.0)).as_vec3();
    let triangles: Vec<[Vec3; 3]> = (0..60)
        .map(|i| {
            // From large ones close by to small ones far away.
            let (centre, size) = (4.0 * draw(), 0.1 + 0.05 * i as f32);
            [(); 3].map(|()| centre + size * draw())
        })
        .collect();
    // Close to the largest, which then is nearly half of all directions.
    let [a, b, c] = triangles[59];
    let close = (a + b + c) / 3.0 + 1e-2 * (b - a).cross(c - a).normalize();
    for (x, sides) in [
        (close, Sides::Both),
        (Vec3::ZERO, Sides::Both),
        (Vec3::new(3.0, -2.0, 5.0), Sides::Front),
        (Vec3::X, Sides::Front),
    ] {
        let light = MeshLight::new(&triangles, sides).unwrap();
        let seen = light.seen_from(x);
        let mut met = 0;
        for _ in 0..2000 {
            let w = draw().as_dvec3().normalize();
            let hits = triangles.iter().filter_map(|t| {
                let [a, b, c] = t.map(|v| v.as_dvec3() - x.as_dvec3());
                let (ab, ac) = (b - a, c - a);
                let p = w.cross(ac);
                let determinant = ab.dot(p);
                let (u, q) = (-a.dot(p) / determinant, (-a).cross(ab));
                let (v, distance) = (w.dot(q) / determinant, ac.dot(q) / determinant);
                let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0;
                let cosine = -ab.cross(ac).normalize().dot(w);
                let lit = cosine > 0.0 || sides == Sides::Both;
                (inside && lit).then(|| distance * distance / cosine.abs())
            });
            let expected = hits.sum::<f64>() / light.area();
            met += u32::from(expected > 0.0);
            near(seen.density(&w), expected, 1e-4);
        }
        assert!(met > 50, "{met}");
    }
}

/// Two triangles at height 1, of areas 1/2 and 3/2, facing down.
fn plates(sides: Sides) -> MeshLight {
    let small = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0)];
    let large = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, -1.0, 1.0), Vec3::new(-3.0, 0.0, 1.0)];
    MeshLight::new(&[small, [large[0], large[2], large[1]]], sides).unwrap()
}

#[test]
fn two_plates_of_light() {
    let light = plates(Sides::Front);
    assert_eq!((light.len(), light.is_empty(), light.area()), (2, false, 2.0));
    assert_eq!(light.bytes(), 2 * 64 + 2 * 8);
    all_near(&[light.mass(0), light.mass(1)], &[0.25, 0.75], 1e-15);
    all_near(&[light.density_on(0), light.density_on(1), light.density_on(2)], &[0.5, 0.5, 0.0], 1e-15);
    assert_eq!(light.select(0.7).0, 1);
    near(light.select(0.7).1, 0.75, 1e-15);
    all_near(&light.variate_knots(0), &[0.25], 1e-15);
    assert_eq!(light.variate_knots(1), [0.0; 0]);
    near(light.left_over(&[0.625, 0.0, 0.0]).unwrap(), 0.5, 1e-14);
    near(light.domain().measure(), 2.0, 1e-15);
    // The fold of (0.25, 0.75) is (0.125, 0.625, 0.25).
    let s = light.sample_surface([0.1, 0.25, 0.75]);
    assert_eq!((s.triangle, s.barycentric, s.normal), (0, Vec3::new(0.125, 0.625, 0.25), Vec3::NEG_Z));
    assert!((s.point - Vec3::new(0.25, 0.625, 1.0)).length() < 1e-6, "{s:?}");
    near(s.density, 0.5, 1e-15);
    let root = plates(Sides::Front).with_warp(TriangleWarp::SquareRoot).sample_surface([0.1, 0.25, 0.5]);
    assert_eq!(root.barycentric, Vec3::new(0.5, 0.25, 0.25));
    // From the origin: distance d, cosine 1 / d.
    let seen = light.sample_from(Vec3::ZERO, [0.1, 0.25, 0.75]).unwrap();
    let d = (0.25_f64.powi(2) + 0.625_f64.powi(2) + 1.0).sqrt();
    near(seen.distance.into(), d, 1e-6);
    near(seen.density, 0.5 * d.powi(3), 1e-6);
    near(light.density_from(Vec3::ZERO, seen.point, 0), 0.5 * d.powi(3), 1e-6);
    assert!((seen.direction.as_dvec3() - DVec3::new(0.25, 0.625, 1.0) / d).length() < 1e-6);
    assert_eq!((seen.triangle, light.density_from(Vec3::ZERO, seen.point, 2)), (0, 0.0));
    // From above it is dark, unless both sides emit.
    let above = Vec3::new(0.0, 0.0, 2.0);
    assert!(light.sample_from(above, [0.1, 0.25, 0.75]).is_none());
    assert_eq!(light.density_from(above, seen.point, 0), 0.0);
    let both = plates(Sides::Both);
    near(both.sample_from(above, [0.1, 0.25, 0.75]).unwrap().density, 0.5 * d.powi(3), 1e-6);
    near(both.density_from(above, seen.point, 0), 0.5 * d.powi(3), 1e-6);
    // Uniform in the solid angle of the small one.
    let small = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0)];
    let angle = SphericalTriangle::new(Vec3::ZERO, small).unwrap();
    let within = |light: &MeshLight, x| light.sample_selected(x, (0, 0.3), Placement::SolidAngle, [0.3, 0.6]);
    let (s, w) = (within(&light, Vec3::ZERO).unwrap(), angle.sample([0.3, 0.6]));
    assert!(
        (s.direction.as_dvec3() - w).length() < 1e-6 && (s.point.as_dvec3() - w / w.z).length() < 1e-6,
        "{s:?}"
    );
    near(s.distance.into(), 1.0 / w.z, 1e-6);
    near(s.density, 0.3 / angle.solid_angle(), 1e-12);
    near(light.density_selected(Vec3::ZERO, s.point, (0, 0.3), Placement::SolidAngle), s.density, 1e-12);
    assert_eq!(s.triangle, 0);
    assert!(within(&light, above).is_none() && within(&both, above).is_some());
    assert_eq!(light.density_selected(above, s.point, (0, 0.3), Placement::SolidAngle), 0.0);
    // Weights count: 1/2 times 9 against 3/2.
    let [a, b] = [small, [small[0], small[2] * Vec3::new(3.0, 1.0, 1.0), small[1]]];
    let weighted = MeshLight::weighted([(a, Sides::Front, 9.0), (b, Sides::Both, 1.0)]).unwrap();
    all_near(
        &[weighted.mass(0), weighted.mass(1), weighted.density_on(0), weighted.area()],
        &[0.75, 0.25, 1.5, 2.0],
        1e-15,
    );
    assert!(matches!(MeshLight::weighted([(a, Sides::Front, -1.0)]), Err(Error::Weight { index: 0, .. })));
    assert_eq!(
        MeshLight::weighted([(a, Sides::Front, 0.0)]).map(|_| ()),
        Err(Error::NoArea { triangles: 1 })
    );
}

/// Straight up, through the plates of another light below it: the density sums over both, and the rivals are mistaken in one factor.
#[test]
fn rivals_of_a_light() {
    // A slope with normal (0.6, 0, -0.8) through (0, 0, 2), of area 2; a plate at height 1, of area 1/2.
    let (along, across) = (Vec3::new(0.8, 0.0, 0.6), Vec3::Y);
    let at = |centre: Vec3, a: Vec3, b: Vec3| [centre - a - b, centre - a + b, centre + a];
    let slope = at(Vec3::Z * 2.0, along, across);
    let plate = at(Vec3::Z, 0.5 * Vec3::X, 0.5 * Vec3::Y);
    let light = MeshLight::new(&[slope, plate], Sides::Front).unwrap();
    near(light.area(), 2.5, 1e-6);
    let seen = light.seen_from(Vec3::ZERO);
    let up = DVec3::new(1e-4, 1e-4, 1.0).normalize();
    near(seen.density(&up), 0.4 * (4.0 / 0.8 + 1.0), 1e-3);
    let expected = [
        0.4 * (4.0 + 1.0),
        0.4 * (4.0 * 0.8 + 1.0),
        0.4 * (2.0 / 0.8 + 1.0),
        0.4 * (16.0 / 0.8 + 1.0),
        0.4 * (1.0 / 0.8 + 1.0),
        0.4 * 2.0,
    ];
    for ((what, found), expected) in seen.rivals(&up).into_iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{what}: {found}, not {expected}");
    }
    assert_eq!(seen.rivals(&up).len(), 6);
    let (sample, own) =
        (seen.sample(&[0.1, 0.3, 0.4]).unwrap(), light.sample_from(Vec3::ZERO, [0.1, 0.3, 0.4]).unwrap());
    assert_eq!((sample.point, sample.density), (own.direction.as_dvec3(), seen.density(&sample.point)));
    // No direction slips between two triangles.
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 1.0));
    let quad = [[0, 2, 1], [0, 3, 2]].map(|t| t.map(|i: usize| corners[i]));
    let quad = MeshLight::new(&quad, Sides::Front).unwrap();
    assert!(quad.seen_from(Vec3::ZERO).density(&DVec3::Z) > 0.0);
    assert_eq!((seen.density(&-up), seen.density(&DVec3::X)), (0.0, 0.0));
    assert_eq!(
        (seen.dimensions(), seen.variate_knots(0), seen.variate_knots(1)),
        (3, light.variate_knots(0), vec![])
    );
}

#[test]
fn weights_of_strategies() {
    let strategies = [(2.0, 1.0), (1.0, 4.0), (1.0, 0.0)];
    for (own, balance, power) in [(0, 2.0 / 6.0, 4.0 / 20.0), (1, 4.0 / 6.0, 16.0 / 20.0), (2, 0.0, 0.0)] {
        all_near(&[Heuristic::Balance.weight_among(own, strategies)], &[balance], 1e-15);
        all_near(&[Heuristic::Power.weight_among(own, strategies)], &[power], 1e-15);
    }
    // Products of what is tiny: their ratio is 1, their squares are nothing.
    assert_eq!(Heuristic::Power.weight_among(0, [(1.0, 1e-200), (1e-200, 1.0)]), 0.5);
    assert_eq!(Heuristic::Balance.weight_among(0, [(1e-200, 1.0), (1e-200, 1.0)]), 0.5);
    // A large share of a strategy that never draws here.
    let shares = [(1e-30_f32, 1.0), (1e30, 0.0), (1e-30, 1.0)];
    assert_eq!(Heuristic::Balance.weight_among(0, shares), 0.5);
    // A large density of a strategy that never draws.
    near(Heuristic::Power.weight_among(0, [(1.0, 3.0), (0.0, 1e300), (2.0, 2.0)]), 9.0 / 25.0, 1e-15);
}

// ---- mixtures ----

fn names(rivals: Vec<(&'static str, f64)>) -> Vec<f64> {
    rivals.into_iter().map(|r| r.1).collect()
}

#[test]
fn a_mixture_by_hand() {
    let (cosine, uniform) = (0.8 / PI, 0.5 / PI);
    let w = DVec3::new(0.0, -0.6, 0.8);
    let mixture = Mixture::new(0.25, CosineHemisphere, UniformHemisphere).unwrap();
    near(mixture.density(&w), 0.25 * cosine + 0.75 * uniform, 1e-6);
    let expected = [cosine, uniform, cosine + uniform, 0.75 * cosine + 0.25 * uniform];
    all_near(&names(mixture.rivals(&w)), &expected, 1e-6);
    assert_eq!(
        (mixture.dimensions(), mixture.variate_knots(0), mixture.variate_knots(1)),
        (3, vec![0.25], vec![])
    );
    // The border belongs to the second.
    let second = Sampler::sample(&UniformHemisphere, &[0.3, 0.4]).unwrap().point;
    assert_eq!(mixture.sample(&[0.25, 0.3, 0.4]).unwrap().point, second);
    assert_ne!(mixture.sample(&[0.25_f64.next_down(), 0.3, 0.4]).unwrap().point, second);
    // Either part leads back to the point.
    let preimages = mixture.preimages(&w).unwrap();
    let weights: Vec<f64> = preimages.iter().map(|p| p.weight).collect();
    assert_eq!(
        (weights, preimages.iter().map(|p| p.selecting).collect::<Vec<_>>()),
        (vec![0.25, 0.75], vec![1, 1])
    );
    all_near(&preimages[0].xi, &[0.125, 0.36, 0.75], 1e-12);
    all_near(&preimages[1].xi, &[0.625, 0.2, 0.75], 1e-12);
    for preimage in preimages {
        assert!((mixture.sample(&preimage.xi).unwrap().point - w).length() < 1e-6);
    }
    // Where one has no density, or none is chosen, the other is all there is.
    for (c, first) in [(0.0, false), (1.0, true)] {
        let one = Mixture::new(c, CosineHemisphere, UniformHemisphere).unwrap();
        let preimages = one.preimages(&w).unwrap();
        assert_eq!((preimages.len(), preimages[0].weight, one.variate_knots(0)), (1, 1.0, vec![]));
        all_near(&[preimages[0].xi[1]], &[if first { 0.36 } else { 0.2 }], 1e-12);
        assert_eq!(
            one.density(&w),
            if first {
                CosineHemisphere.density(w.as_vec3())
            } else {
                UniformHemisphere.density(w.as_vec3())
            }
            .into()
        );
    }
    // Of weight 0, a part may even be infinite.
    let infinite = || {
        from_fn(
            Hemisphere,
            |[u, v]: [f32; 2]| CosineHemisphere.sample(Vec2::new(u, v)),
            |_: DVec3| f64::INFINITY,
        )
    };
    let uniform_alone = Sampler::density(&UniformHemisphere, &w);
    assert_eq!(Mixture::new(0.0, infinite(), UniformHemisphere).unwrap().density(&w), uniform_alone);
    assert_eq!(Mixture::new(1.0, UniformHemisphere, infinite()).unwrap().density(&w), uniform_alone);
    let under = Mixture::new(0.25, CosineHemisphere, UniformHemisphere).unwrap().preimages(&DVec3::NEG_Z);
    assert_eq!(under, Some(vec![]));
    let no_inverse = Mixture::new(0.25, CosineHemisphere, PhongLobe::new(Vec3::Z, 1.0).unwrap()).unwrap();
    assert_eq!(no_inverse.preimages(&w), None);
    assert!(Mixture::new(-0.01, CosineHemisphere, UniformHemisphere).is_err());
}

#[test]
fn a_mixture_of_tables_by_hand() {
    let tables = [[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 0.0, 0.0]].map(|w| DiscreteCdf::new(&w).unwrap());
    let [first, second] = tables;
    let mixture = Mixture::new(0.5, first, second).unwrap();
    all_near(&[mixture.density(&0), mixture.density(&2)], &[0.375, 0.125], 1e-15);
    near(mixture.cell_mass(&patches(1..3)).unwrap(), 0.5 * 0.5 + 0.5 * 0.5, 1e-15);
    near(mixture.cell_mass(&patches(2..4)).unwrap(), 0.25, 1e-15);
    all_near(&sorted(mixture.variate_knots(1)), &[0.25, 0.5, 0.75], 1e-15);
    assert_eq!((mixture.variate_knots(0), mixture.variate_knots(2)), (vec![0.5], vec![]));
    // Of another number of variates: the shorter part fills up with halves, and has no knots past its end.
    let light = plates(Sides::Front);
    let longer = Mixture::new(0.5, &light, Mixture::new(0.5, &light, &light).unwrap()).unwrap();
    assert_eq!(longer.dimensions(), 5);
    all_near(&longer.variate_knots(1), &[0.25, 0.5], 1e-15);
    all_near(&longer.variate_knots(2), &[0.25, 0.25], 1e-15);
    assert_eq!((longer.variate_knots(3), longer.variate_knots(4)), (vec![], vec![]));
    let point = SurfacePoint { triangle: 1, barycentric: DVec3::new(0.125, 0.625, 0.25) };
    let preimages = longer.preimages(&point).unwrap();
    let described: Vec<_> = preimages.iter().map(|p| (p.xi.len(), p.selecting)).collect();
    assert_eq!(described, [(5, 2), (5, 3), (5, 3)]);
    all_near(&preimages.iter().map(|p| p.weight).collect::<Vec<_>>(), &[0.375, 0.1875, 0.1875], 1e-15);
    all_near(&preimages[0].xi, &[0.25, 0.625, 0.25, 0.75, 0.5], 1e-6);
    all_near(&preimages[2].xi, &[0.75, 0.75, 0.625, 0.25, 0.75], 1e-6);
}

#[test]
fn a_delta_beside_a_table() {
    let table = DiscreteCdf::new(&[1.0; 4]).unwrap();
    let sampler = WithDelta::new(0.2, "mirror", &table).unwrap();
    assert_eq!((sampler.dimensions(), sampler.variate_knots(0)), (2, vec![0.2]));
    all_near(&sampler.variate_knots(1), &[0.25, 0.5, 0.75], 1e-15);
    assert_eq!((sampler.density(&Mixed::Atom(0)), sampler.density(&Mixed::Atom(1))), (0.2, 0.0));
    all_near(&[sampler.density(&Mixed::Continuous(3))], &[0.2], 1e-15);
    // Patch 4 is the atom.
    let masses = [0..2, 1..5, 4..5, 0..5].map(|cell| sampler.cell_mass(&patches(cell)).unwrap());
    all_near(&masses, &[0.4, 0.8, 0.2, 1.0], 1e-15);
    let light = plates(Sides::Front);
    let lit = WithDelta::new(0.2, "mirror", &light).unwrap();
    assert_eq!((lit.variate_knots(1), lit.variate_knots(2)), (light.variate_knots(0), vec![]));
    let point = Mixed::Continuous(SurfacePoint { triangle: 1, barycentric: DVec3::new(0.125, 0.625, 0.25) });
    near(lit.preimages(&point).unwrap()[0].weight, 0.8 * 0.75, 1e-15);
    let map = Environment::from_map(small_map(), RowWarp::UniformV).unwrap();
    assert_eq!(WithDelta::new(0.2, "mirror", &map).unwrap().knots(), Knots::grid(2, 4));
    assert_eq!(Mixture::new(0.2, &map, UniformSphere).unwrap().knots(), Knots::grid(2, 4));
    for c in [0.0, 1.0] {
        assert_eq!(WithDelta::new(c, "mirror", &table).unwrap().variate_knots(0), [0.0; 0]);
    }
    let drawn = sampler.sample(&[0.2, 0.3]).unwrap();
    assert_eq!(drawn.point, Mixed::Continuous(1));
    near(drawn.density, 0.2, 1e-15);
    assert_eq!(
        sampler.sample(&[0.2_f64.next_down(), 0.3]).unwrap(),
        Sample { point: Mixed::Atom(0), density: 0.2 }
    );
    let smooth = WithDelta::new(0.2, "mirror", CosineHemisphere).unwrap();
    let w = DVec3::new(0.0, -0.6, 0.8);
    let [preimage] = &smooth.preimages(&Mixed::Continuous(w)).unwrap()[..] else {
        panic!("not one preimage")
    };
    assert_eq!((preimage.selecting, preimage.weight), (1, 0.8));
    all_near(&preimage.xi, &[0.6, 0.36, 0.75], 1e-12);
    assert_eq!(smooth.preimages(&Mixed::Atom(0)), None);
    assert!(smooth.has_density());
    let drawn =
        WithDelta::new(0.2, "mirror", from_draws(warpcheck::domain::Disk, |xi: [f64; 2]| xi)).unwrap();
    assert!(!drawn.has_density());
}

// ---- what all samplers have ----

/// A reference and a box answer as the sampler does, and do not fall back on what the trait has for all.
#[test]
fn pointers_to_samplers_answer_like_them() {
    /// Answers everything with something of its own.
    struct Odd;
    impl Sampler for Odd {
        type Domain = warpcheck::domain::Interval;
        fn domain(&self) -> Self::Domain {
            warpcheck::domain::Interval::positive()
        }
        fn dimensions(&self) -> usize {
            1
        }
        fn sample(&self, xi: &[f64]) -> Option<Sample<f64>> {
            (xi[0] < 0.5).then_some(Sample { point: xi[0], density: 2.0 })
        }
        fn fill(&self, _: &[f64], samples: &mut [Option<Sample<f64>>]) {
            samples.fill(Some(Sample { point: 7.0, density: 8.0 }));
        }
        fn fill_points(&self, _: &[f64], points: &mut [Option<f64>]) {
            points.fill(Some(9.0));
        }
        fn density(&self, x: &f64) -> f64 {
            3.0 * x
        }
        fn density_many(&self, points: &[f64], out: &mut Vec<f64>) {
            out.clear();
            out.resize(points.len(), 5.0);
        }
        fn invert(&self, x: &f64) -> Option<Vec<f64>> {
            Some(vec![*x])
        }
        fn preimages(&self, _: &f64) -> Option<Vec<Preimage>> {
            Some(vec![])
        }
        fn left_over(&self, xi: &[f64]) -> Option<f64> {
            Some(xi[0])
        }
        fn variate_knots(&self, dimension: usize) -> Vec<f64> {
            vec![dimension as f64]
        }
        fn rivals(&self, x: &f64) -> Vec<(&'static str, f64)> {
            vec![("rival", *x)]
        }
        fn cell_mass(&self, _: &Cell) -> Option<f64> {
            Some(0.25)
        }
        fn has_density(&self) -> bool {
            false
        }
        fn is_slow(&self) -> bool {
            true
        }
        fn knots(&self) -> Knots {
            Knots::grid(2, 3)
        }
    }
    fn judge(sampler: impl Sampler<Domain = warpcheck::domain::Interval>) {
        assert_eq!((sampler.dimensions(), sampler.has_density(), sampler.is_slow()), (1, false, true));
        assert_eq!(sampler.domain().measure(), f64::INFINITY);
        assert_eq!(sampler.sample(&[0.25]), Some(Sample { point: 0.25, density: 2.0 }));
        assert_eq!(sampler.sample(&[0.75]), None);
        let (mut samples, mut points, mut densities) = ([None; 2], [None; 2], vec![1.0]);
        sampler.fill(&[0.1, 0.2], &mut samples);
        sampler.fill_points(&[0.1, 0.2], &mut points);
        sampler.density_many(&[0.1, 0.2], &mut densities);
        assert_eq!(samples, [Some(Sample { point: 7.0, density: 8.0 }); 2]);
        assert_eq!((points, densities), ([Some(9.0); 2], vec![5.0; 2]));
        assert_eq!(
            (sampler.density(&2.0), sampler.invert(&0.5), sampler.preimages(&0.5)),
            (6.0, Some(vec![0.5]), Some(vec![]))
        );
        assert_eq!(
            (sampler.left_over(&[0.5]), sampler.variate_knots(4), sampler.rivals(&3.0)),
            (Some(0.5), vec![4.0], vec![("rival", 3.0)])
        );
        assert_eq!((sampler.cell_mass(&patches(0..1)), sampler.knots()), (Some(0.25), Knots::grid(2, 3)));
    }
    judge(&Odd);
    judge(Box::new(Odd));
}

/// Samplers of directions take two variates, and the trait shows what their own methods answer, in `f64`.
#[test]
fn the_trait_shows_samplers_as_they_are() {
    #[track_caller]
    fn judge(
        sampler: &impl Sampler<Domain: warpcheck::domain::Domain<Point = DVec3>>,
        measure: f64,
        own_sample: impl Fn(Vec2) -> Option<DVec3>,
        own_density: impl Fn(Vec3) -> f64,
    ) {
        assert_eq!(sampler.dimensions(), 2);
        near(sampler.domain().measure(), measure, 1e-15);
        for xi in [[0.25, 0.125], [0.5, 0.625], [0.75, 0.875]] {
            let sample = sampler.sample(&xi);
            assert_eq!(sample.map(|s| s.point), own_sample(Vec2::new(xi[0] as f32, xi[1] as f32)));
            if let Some(sample) = sample {
                let density = own_density(sample.point.as_vec3());
                near(sample.density, density, 1e-6);
                near(sampler.density(&sample.point), density, 1e-6);
            }
        }
    }
    let up = Vec3::new(0.36, -0.48, 0.8);
    let some = |w: Vec3| Some(w.as_dvec3());
    let (half, whole) = (TAU, 2.0 * TAU);
    judge(
        &CosineHemisphere,
        half,
        |xi| some(CosineHemisphere.sample(xi)),
        |w| CosineHemisphere.density(w).into(),
    );
    judge(
        &UniformHemisphere,
        half,
        |xi| some(UniformHemisphere.sample(xi)),
        |w| UniformHemisphere.density(w).into(),
    );
    judge(&UniformSphere, whole, |xi| some(UniformSphere.sample(xi)), |w| UniformSphere.density(w).into());
    let phong = PhongLobe::new(up, 3.0).unwrap();
    judge(&phong, half, |xi| phong.sample(xi).and_then(some), |w| phong.density(w).into());
    let ggx = GgxVisibleNormals::new(up, 0.4).unwrap();
    judge(&ggx, half, |xi| ggx.sample(xi).and_then(some), |w| ggx.density(w).into());
    let lobe = VonMisesFisher::new(up, 2.0).unwrap();
    judge(&lobe, whole, |xi| some(lobe.sample(xi)), |w| lobe.density(w).into());
    let octant = SphericalTriangle::new(Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::Z]).unwrap();
    let place = |xi: Vec2| xi.as_dvec2().to_array();
    judge(&octant, whole, |xi| Some(octant.sample(place(xi))), |_| 1.0 / FRAC_PI_2);
    assert_eq!(Sampler::density(&octant, &DVec3::NEG_ONE.normalize()), 0.0);
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let map = Environment::from_map(small_map(), rows).unwrap();
        judge(&map, whole, |xi| some(map.sample(place(xi)).direction), |w| map.density(w).into());
        for form in [Form::Guide, Form::Alias] {
            let map = PackedEnvironment::new(small_map(), rows, form).unwrap();
            judge(&map, whole, |xi| some(map.sample(place(xi)).direction), |w| map.density(w).into());
        }
    }
    // About an oblique direction: along its own tangents.
    let Frame { tangent, bitangent, normal } = Frame::new(up);
    assert!(
        (tangent.cross(bitangent) - normal).length() < 1e-6
            && tangent.is_normalized()
            && tangent.dot(up).abs() < 1e-6
    );
    for (v, local) in [(tangent, Vec3::X), (bitangent, Vec3::Y), (normal, Vec3::Z)] {
        assert!(
            (Frame::new(up).to_local(v) - local).length() < 1e-6
                && (Frame::new(up).to_world(local) - v).length() < 1e-6
        );
    }
}

/// What the trait has for samplers that say nothing of their own.
#[test]
fn what_samplers_do_unless_told() {
    let warp = BarycentricWarp::new(TriangleWarp::LowDistortion, 2.0).unwrap();
    let b = DVec3::new(0.125, 0.625, 0.25);
    assert_eq!(warp.preimages(&b), Some(vec![Preimage { xi: vec![0.25, 0.75], selecting: 0, weight: 1.0 }]));
    assert_eq!((Sampler::density(&warp, &b), warp.density(), warp.domain().measure()), (0.5, 0.5, 2.0));
    let (mut densities, mut points) = (vec![7.0], [None; 2]);
    warp.density_many(&[b, b], &mut densities);
    assert_eq!(densities, [0.5, 0.5]);
    warp.fill_points(&[0.25, 0.75, 0.0, 0.0], &mut points);
    assert_eq!(points, [Some(b), Some(DVec3::Z)]);
    assert!(warp.has_density() && !warp.is_slow());
    assert_eq!((warp.left_over(&[0.5; 2]), warp.rivals(&b), warp.variate_knots(0)), (None, vec![], vec![]));
    assert_eq!((warp.knots(), warp.cell_mass(&patches(0..1))), (Knots::default(), None));
    // Three variates for two axes have no inverse of their own.
    let light = plates(Sides::Front);
    assert_eq!(light.seen_from(Vec3::ZERO).preimages(&DVec3::Z), None);
    assert_eq!(light.seen_from(Vec3::ZERO).invert(&DVec3::Z), None);
    let odd =
        from_fn(warpcheck::domain::Disk, |xi: [f64; 2]| xi, |_: DVec2| 1.0).with_knots(Knots::grid(2, 2));
    assert_eq!((odd.knots(), odd.dimensions()), (Knots::grid(2, 2), 2));
    // One variate, vectors of them.
    let line = || warpcheck::domain::Interval::new(0.0, 1.0);
    let single = from_fn(line(), |x: f64| (x, 3.0), |x: f64| 4.0 * x);
    assert_eq!(single.sample(&[0.25]), Some(Sample { point: 0.25, density: 3.0 }));
    assert_eq!((single.dimensions(), single.density(&0.5)), (1, 2.0));
    let single = from_fn(line(), |x: f32| x, |x: f32| 4.0 * x);
    assert_eq!(single.sample(&[0.25]), Some(Sample { point: 0.25, density: 1.0 }));
    let vector = from_fn(warpcheck::domain::Sphere, |v: Vec3| v, |_: Vec3| 1.0);
    assert_eq!(
        (vector.dimensions(), vector.sample(&[0.0, 0.5, 0.25]).unwrap().point),
        (3, DVec3::new(0.0, 0.5, 0.25))
    );
    // Atoms among them, rejected or not, with a density or not.
    let mixed = || warpcheck::domain::WithAtoms::named(warpcheck::domain::Disk, ["atom"]);
    let density = |_: Mixed<DVec2>| 5.0;
    let point = |[u, v]: [f64; 2]| if u < 0.5 { Mixed::Atom(0) } else { Mixed::Continuous(DVec2::new(u, v)) };
    let kept = |xi: [f64; 2]| xi[1] < 0.5;
    let expected = |density| {
        [Mixed::Atom(0), Mixed::Continuous(DVec2::new(0.75, 0.25))]
            .map(|point| Some(Sample { point, density }))
    };
    let drawn = |s: &dyn Fn(&[f64]) -> Option<Sample<Mixed<DVec2>>>| [s(&[0.25, 0.25]), s(&[0.75, 0.25])];
    let plain = from_fn(mixed(), point, density);
    assert_eq!(drawn(&|xi| plain.sample(xi)), expected(5.0));
    let dense = from_fn(mixed(), move |xi: [f64; 2]| (point(xi), 6.0), density);
    assert_eq!(drawn(&|xi| dense.sample(xi)), expected(6.0));
    let some = from_fn(mixed(), move |xi: [f64; 2]| kept(xi).then(|| point(xi)), density);
    assert_eq!((drawn(&|xi| some.sample(xi)), some.sample(&[0.25, 0.75])), (expected(5.0), None));
    let both = from_fn(mixed(), move |xi: [f64; 2]| kept(xi).then(|| (point(xi), 6.0)), density);
    assert_eq!((drawn(&|xi| both.sample(xi)), both.sample(&[0.25, 0.75])), (expected(6.0), None));
    // The last step before 0 is a point like others.
    let exponential =
        from_statrs(warpcheck::domain::Interval::positive(), statrs::distribution::Exp::new(1.0).unwrap());
    let step = 2.0_f64.powi(-53);
    near(exponential.sample(&[step]).unwrap().point, step, 1e-9);
    assert!(exponential.sample(&[0.0]).unwrap().point > 0.0);
    let drawn = from_draws(warpcheck::domain::Disk, |xi: [f64; 2]| xi);
    assert_eq!(drawn.dimensions(), 2);
    assert!(drawn.density(&DVec2::ZERO).is_nan() && !drawn.has_density());
    let sample = drawn.sample(&[0.25, 0.5]).unwrap();
    assert!(sample.point == DVec2::new(0.25, 0.5) && sample.density.is_nan());
}
