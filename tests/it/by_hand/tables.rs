//! Discrete tables of a few entries, and of many.

use super::*;

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

/// An entry that fills its cell to the step lends nothing, although the heavy one before it gave 4 steps too much.
#[test]
fn an_entry_that_fills_its_cell() {
    let k = 2.0_f64.powi(51);
    let masses = [k + 6.0, k, k - 10.0, k + 4.0];
    let table = DiscreteAlias::new(&masses.map(|m| m - 1.0)).unwrap();
    let step = 2.0_f64.powi(-53);
    assert_eq!([0, 1, 2, 3].map(|i| table.mass(i)), masses.map(|m| m * step));
    assert_eq!([0.25, 0.5 - 4.0 * step, 0.5 - step].map(|xi| table.choose(xi).index), [1; 3]);
    assert_eq!([0.25 - step, 0.25 - 5.0 * step].map(|xi| table.choose(xi).index), [3, 0]);
}

/// A border belongs to the entry that begins there, and the step before it to the one that ends.
#[test]
fn borders_of_ordered_tables() {
    let mut crowd = vec![1e-9; 300];
    crowd[7] = 1.0;
    // The last has a guide in two pieces.
    for weights in [ragged(5), ragged(300), crowd, vec![1.0; 64], ragged(12_000)] {
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
