//! What is set on everything that can be run: its name, how many samples, the seed, alpha. Each has these as methods of its own, made here.

/// The setters that are named, each with what its documentation says first. What has them has a field `settings`, and `name` for a name.
macro_rules! setters {
    () => {};
    (name: $doc:literal; $($others:tt)*) => {
        #[doc = $doc]
        pub fn name(mut self, name: impl Into<String>) -> Self {
            self.name = name.into();
            self
        }
        setters! { $($others)* }
    };
    (samples: $doc:literal; $($others:tt)*) => {
        #[doc = $doc]
        ///
        /// # Panics
        /// If it is 0.
        #[track_caller]
        pub fn samples(mut self, samples: u64) -> Self {
            assert!(samples > 0, "there must be at least 1 sample");
            self.settings.samples = samples;
            self
        }
        setters! { $($others)* }
    };
    (seed: $doc:literal; $($others:tt)*) => {
        #[doc = $doc]
        pub fn seed(mut self, seed: u64) -> Self {
            self.settings.seed = seed;
            self
        }
        setters! { $($others)* }
    };
    (alpha: $doc:literal; $($others:tt)*) => {
        #[doc = $doc]
        ///
        /// # Panics
        /// Unless it lies between 0 and 1.
        #[track_caller]
        pub fn alpha(mut self, alpha: f64) -> Self {
            assert!(alpha > 0.0 && alpha < 1.0, "alpha is {alpha}; it must lie between 0 and 1");
            self.settings.alpha = alpha;
            self
        }
        setters! { $($others)* }
    };
    (settings; $($others:tt)*) => {
        /// All settings at once, in place of any that were made before.
        pub fn settings(mut self, settings: Settings) -> Self {
            self.settings = settings;
            self
        }
        setters! { $($others)* }
    };
    (run: $doc:literal; $($others:tt)*) => {
        #[doc = $doc]
        pub fn run(self) -> Report {
            let settings = self.settings.clone();
            Report::new(vec![self.examine()], &settings)
        }
        setters! { $($others)* }
    };
}

pub(super) use setters;
