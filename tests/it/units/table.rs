use std::f64::consts::PI;
use warpcheck::domain::{
    Cell, Discrete, Disk, Domain, Hemisphere, Integrator, Interval, Location, Sphere, Square,
};
use warpcheck::foreign::*;

/// The integral of the table in its own measure is that of its density in the domain's.
#[test]
fn measures_of_texels_fit_the_densities() {
    fn fits<D: Coordinates + Domain>(domain: D, rows: usize, columns: usize) {
        for measure in Measure::of(&domain) {
            let values = (0..rows * columns).map(|i| 1.0 + (i % 5) as f64).collect();
            let table = Table::new(domain.clone(), rows, columns, values, measure).unwrap().normalised();
            let integrator =
                Integrator { relative_tolerance: 1e-7, max_evaluations: 400_000, ..Integrator::default() };
            let whole =
                integrator.integrate(&domain, &Cell::whole(&domain), &table.knots(), |p| table.density(p));
            assert!((whole.value - 1.0).abs() < 1e-5, "{} {measure}: {}", domain.name(), whole.value);
        }
    }
    fits(Sphere, 7, 12);
    fits(Hemisphere, 6, 5);
    fits(Disk, 3, 8);
    fits(Square, 4, 3);
    fits(Interval::new(-1.0, 2.0), 1, 9);
}

#[test]
fn poles_have_the_density_of_the_middle_of_their_row() {
    let table = Table::new(Hemisphere, 4, 1, vec![1.0, 3.0, 2.0, 0.0], Measure::ThetaPhi).unwrap();
    let first = (PI / 16.0).sin();
    assert_eq!(table.density(&glam::DVec3::Z), 1.0 / first);
    let mut many = Vec::new();
    table.at_many(
        &[Location { patch: 0, at: [0.0, 0.3] }, Location { patch: 0, at: [0.125, 0.3] }],
        &mut many,
    );
    assert!(many[0] == many[1] && many[0].is_finite(), "{many:?}");
}

/// Texels before and behind, round the seam but not over an edge.
#[test]
fn ranges_are_of_the_texels_around() {
    let square = Table::new(Square, 3, 3, (1..=9).map(f64::from).collect(), Measure::Area).unwrap();
    assert_eq!(square.range(&glam::DVec2::new(0.5, 0.5)), [1.0, 9.0]);
    assert_eq!(square.range(&glam::DVec2::new(0.9, 0.1)), [2.0, 6.0]);
    assert_eq!(square.range(&glam::DVec2::new(1.5, 0.1)), [0.0, 0.0]);
    let disk = Table::new(Disk, 1, 4, vec![1.0, 2.0, 3.0, 4.0], Measure::Area).unwrap();
    assert_eq!(disk.range(&glam::DVec2::new(0.5, 1e-3)), [1.0, 4.0]);
    assert_eq!(disk.range(&glam::DVec2::new(-1e-3, 0.5)), [1.0, 3.0]);
    let few = Table::new(Interval::new(0.0, 1.0), 1, 2, vec![0.5, 1.5], Measure::Length).unwrap();
    assert_eq!(few.range(&0.9), [0.5, 1.5]);
}

/// All texels of a cell, and those that rounding may put its borders into.
#[test]
fn cells_of_positive_texels() {
    let cell = |low: [f64; 2], high: [f64; 2]| Cell { patches: 0..1, low, high };
    // Rows along y, columns along x: the texel of row 1, column 2 is black.
    let values = vec![1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0];
    let square = Table::new(Square, 3, 3, values, Measure::Area).unwrap();
    assert!(square.is_positive_over(&cell([0.0, 0.0], [0.6, 1.0])));
    assert!(square.is_positive_over(&cell([0.0, 0.7], [1.0, 1.0])));
    assert!(!square.is_positive_over(&cell([0.6, 0.3], [0.7, 0.4])));
    assert!(!square.is_positive_over(&cell([0.0, 0.0], [1.0, 1.0])));
    // Up to a border of the black one.
    assert!(!square.is_positive_over(&cell([0.0, 0.0], [2.0 / 3.0, 0.5])));
    let entries = Table::new(Discrete::new(4), 1, 4, vec![0.5, 0.0, 0.25, 0.25], Measure::Mass).unwrap();
    let run = |patches| Cell { patches, low: [0.0; 2], high: [1.0; 2] };
    assert!(entries.is_positive_over(&run(2..4)) && entries.is_positive_over(&run(0..1)));
    assert!(!entries.is_positive_over(&run(0..2)));
}
