use warpcheck::estimator::Strategy;

#[test]
fn names_are_read_back() {
    for name in
        ["uniform", "brdf", "light", "mis:0", "mis:0.25", "mis:1", "mis:auto", "mis-two", "mis-two:power"]
    {
        assert_eq!(name.parse::<Strategy>().unwrap().to_string(), name);
    }
    assert_eq!("mis".parse::<Strategy>().unwrap(), Strategy::Mis { brdf_weight: 0.5 });
    for name in
        ["", "Light", "mis:", "mis:nan", "mis:-0.1", "mis:1.01", "mis:inf", "mis2", "mis-two:", "mis-two:0.5"]
    {
        let error = name.parse::<Strategy>().unwrap_err().to_string();
        assert!(error.starts_with(&format!("`{name}` is no strategy")), "{error}");
    }
}
