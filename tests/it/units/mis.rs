use warpcheck::sampler::Heuristic;

const BOTH: [Heuristic; 2] = [Heuristic::Balance, Heuristic::Power];

#[test]
fn weights_add_up() {
    for heuristic in BOTH {
        for densities in [[1.0, 2.0, 3.0], [1e-30, 1e30, 1.0], [0.0, 1e-300, 1e-308], [5.0, 5.0, 0.0]] {
            let strategies = [(2.0, densities[0]), (1.0, densities[1]), (0.5, densities[2])];
            let sum: f64 = (0..3).map(|i| heuristic.weight_among(i, strategies)).sum();
            assert!((sum - 1.0).abs() < 1e-15, "{heuristic:?} {densities:?}: {sum}");
        }
    }
}

#[test]
fn nothing_and_everything() {
    let infinite = f32::INFINITY;
    for heuristic in BOTH {
        assert_eq!(heuristic.weight(0.0_f32, 0.0), 0.0);
        assert_eq!(heuristic.weight(0.0_f32, 1.0), 0.0);
        assert_eq!(heuristic.weight(1.0_f32, 0.0), 1.0);
        assert_eq!(heuristic.weight(infinite, 1.0), 1.0);
        assert_eq!(heuristic.weight(1.0, infinite), 0.0);
        assert_eq!(heuristic.weight(infinite, infinite), 0.5);
        assert_eq!(heuristic.weight(f32::MAX, f32::MAX), 0.5);
        assert_eq!(heuristic.weight_among(0, [(0.0_f32, infinite), (1.0, 1.0)]), 0.0);
        assert_eq!(heuristic.weight_among(1, [(0.0_f32, infinite), (1.0, 1.0)]), 1.0);
    }
    assert_eq!(Heuristic::Balance.weight_among(0, [(3.0, infinite), (1.0, infinite)]), 0.75);
}
