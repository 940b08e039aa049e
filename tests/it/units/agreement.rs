use warpcheck::estimator::*;

fn flat(mean: f64, error: f64, effective: f64) -> Blocks {
    let (means, standard_errors) = (vec![[mean; 3]; 4], vec![[error; 3]; 4]);
    Blocks { size: 2, columns: 2, rows: 2, means, standard_errors, effective: vec![[effective; 3]; 4] }
}

#[test]
fn figures() {
    let (a, b) = (flat(1.3, 0.03, 1e3), flat(1.25, 0.04, f64::INFINITY));
    let judged = compare(&a, &b, Rules::default(), |x, y| (x, y) == (1, 0)).unwrap();
    assert_eq!((judged.compared, judged.left_out, judged.too_few), (9, 3, 0));
    assert!((judged.largest.unwrap().z - 1.0).abs() < 1e-6);
    let (difference, error) = judged.brightness[1];
    assert!((difference - 0.05 / 1.275).abs() < 1e-12);
    assert!((error - 0.05 / 1.275 / 3.0_f64.sqrt()).abs() < 1e-9);
    assert!(judged.agrees(1e-3) && judged.would_catch(1e-3) > 3.0 * error);
    // What both allow for is not averaged away.
    let allowed = compare(&a, &b, Rules { allowance: 0.1, ..Rules::default() }, |_, _| false).unwrap();
    assert!(allowed.brightness[0].1 > 0.1);
}

#[test]
fn few_samples_and_no_variance() {
    let judged = compare(&flat(0.0, 0.0, 0.0), &flat(1.0, 0.1, 1e3), Rules::default(), |_, _| false).unwrap();
    assert_eq!((judged.compared, judged.too_few), (0, 12));
    assert!(!judged.agrees(1e-3)); // nothing was shown
    assert_eq!(judged.judgement(1e-3), Judgement::Inconclusive);
    assert_eq!(judged.to_string(), "nothing to compare");
    let exact =
        |a, b| compare(&flat(a, 0.0, 1e3), &flat(b, 0.0, 1e3), Rules::default(), |_, _| false).unwrap();
    assert!(exact(0.5, 0.500_000_1).agrees(1e-3)); // rounding
    assert!(!exact(0.5, 0.501).agrees(1e-3));
    assert_eq!(exact(0.5, 0.5).judgement(1e-3), Judgement::Agree);
    assert_eq!(exact(0.5, 0.501).judgement(1e-3), Judgement::Differ);
    assert!(!exact(0.5, f64::NAN).agrees(1e-3));
}
