use warpcheck::domain::{Discrete, Knots, Location, Partition, Square};

fn grid_pilots(n: usize) -> Vec<Location> {
    (0..n * n)
        .map(|i| Location { patch: 0, at: [(i % n) as f64, (i / n) as f64].map(|x| (x + 0.5) / n as f64) })
        .collect()
}

#[test]
fn leaves_tile_the_domain() {
    let partition = Partition::from_pilots(&Square, grid_pilots(32), &Knots::default(), 4);
    let area: f64 = partition.leaves().iter().map(|c| (c.high[0] - c.low[0]) * (c.high[1] - c.low[1])).sum();
    assert!((area - 1.0).abs() < 1e-12, "{area}");
    for pilot in grid_pilots(7) {
        let cell = &partition.leaves()[partition.leaf_of(&pilot)];
        for axis in 0..2 {
            assert!(cell.low[axis] <= pilot.at[axis] && pilot.at[axis] <= cell.high[axis]);
        }
    }
}

#[test]
fn an_entry_with_most_of_the_mass_gets_a_cell_of_its_own() {
    let mut pilots = vec![Location { patch: 3, at: [0.0; 2] }; 1000];
    pilots.extend((0..10).map(|patch| Location { patch, at: [0.0; 2] }));
    let partition = Partition::from_pilots(&Discrete::new(10), pilots, &Knots::default(), 4);
    assert!(partition.leaves().iter().any(|c| c.patches == (3..4)));
}

#[test]
fn groups_respect_target_and_floor() {
    let partition = Partition::from_pilots(&Square, grid_pilots(32), &Knots::default(), 4);
    let mut mass = vec![1.0; partition.leaves().len()];
    mass[0] = 1e-9;
    let total: f64 = mass.iter().sum();
    let groups = partition.group(&mass, total / 16.0, 0.5);
    assert!(groups.cells.len() >= 16 && groups.cells.len() <= 34, "{}", groups.cells.len());
    let fine = partition.group(&mass, 0.0, 0.5);
    assert_eq!(fine.of_leaf[0], None, "a light leaf is pooled");
    assert_eq!(fine.cells.len(), mass.len() - 1);
}
