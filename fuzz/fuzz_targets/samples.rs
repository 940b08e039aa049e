//! Any bytes as a file of samples (NumPy arrays and archives, text, bare numbers) of directions: whole rows, or a sentence.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;
use warpcheck::domain::Hemisphere;
use warpcheck::foreign::{Columns, Convention, Place, Samples, read_array};
use warpcheck::verify::Rows;

/// Archives are read where they lie, so that there has to be a file.
static FILE: LazyLock<std::path::PathBuf> =
    LazyLock::new(|| std::env::temp_dir().join(format!("warpcheck-fuzz-{}", std::process::id())));

/// More rows than any input of 16 KiB holds that isn't packed; of packed ones the first.
const MOST: usize = 1 << 16;

fn is_a_sentence(error: &dyn std::fmt::Display) {
    assert_eq!(error.to_string().lines().count(), 1, "{error}");
}

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).expect("a file for the input");
    let place = Place::File(FILE.clone());
    for columns in [None, Some("x,y,z:f32"), Some("theta,phi,pdf:f64")] {
        let columns: Option<Columns> = columns.map(|names| names.parse().expect("columns"));
        let mut samples = match Samples::open(&place, columns.as_ref(), &Convention::new(Hemisphere)) {
            Ok(samples) => samples,
            Err(error) => {
                is_a_sentence(&error);
                continue;
            }
        };
        let (mut numbers, width) = (Vec::new(), samples.width());
        while numbers.len() < MOST * width {
            match samples.read(4096, &mut numbers) {
                Ok(0) => break,
                Ok(_) => assert_eq!(numbers.len() % width, 0),
                Err(error) => {
                    is_a_sentence(&error);
                    break;
                }
            }
        }
    }
    if let Err(error) = read_array(&FILE) {
        is_a_sentence(&error);
    }
});
