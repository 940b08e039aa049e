use rand::Rng;
use warpcheck::random::*;

#[test]
fn streams_do_not_depend_on_each_other() {
    let first: Vec<u64> = (0..4).map(|i| stream(1, "a", i).next_u64()).collect();
    let again: Vec<u64> = (0..4).rev().map(|i| stream(1, "a", i).next_u64()).collect();
    assert!(first.iter().eq(again.iter().rev()));
    assert_ne!(stream(1, "a", 0).next_u64(), stream(1, "b", 0).next_u64());
    assert_ne!(stream(1, "a", 0).next_u64(), stream(2, "a", 0).next_u64());
}

#[test]
fn f32_variates_stay_under_one() {
    assert_eq!(to_f32(0.0), 0.0);
    assert_eq!(to_f32(ONE_MINUS_EPSILON_F64), ONE_MINUS_EPSILON_F32);
    assert_eq!(to_f32(0.5), 0.5);
}
