use warpcheck::estimator::{LightSampling, Selection};
use warpcheck::sampler::Placement;

#[test]
fn names_are_read_back() {
    assert_eq!(LightSampling::all().count(), 6);
    assert_eq!(LightSampling::all().next(), Some(LightSampling::default()));
    for LightSampling { selection, placement } in LightSampling::all() {
        assert_eq!(selection.to_string().parse::<Selection>().unwrap(), selection);
        assert_eq!(placement.to_string().parse::<Placement>().unwrap(), placement);
    }
    let error = "distance".parse::<Selection>().unwrap_err().to_string();
    assert_eq!(error, "`distance` is no way to sample lights; it must be one of area, power, power/d2");
    assert!("angle".parse::<Placement>().is_err());
}
