//! Seeded, counter-based streams of uniform variates, and the way from bits to floats.
//!
//! Every stream is a ChaCha8 generator whose key holds the run's seed and the stream's purpose, and whose
//! 64-bit stream number is the shard. So a shard can be drawn alone, in any order and on any thread, and always
//! gives the same bits; two purposes or two shards never share a variate.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The largest `f32` under 1.
pub const ONE_MINUS_EPSILON_F32: f32 = 1.0 - f32::EPSILON / 2.0;
/// The largest `f64` under 1.
pub const ONE_MINUS_EPSILON_F64: f64 = 1.0 - f64::EPSILON / 2.0;

/// The stream number `shard` for `purpose` in the run seeded by `seed`.
///
/// ```
/// use warpcheck::random::{stream, unit_f64};
/// let (mut a, mut b) = (stream(7, "pilot", 3), stream(7, "pilot", 3));
/// assert_eq!(unit_f64(&mut a), unit_f64(&mut b));
/// assert_ne!(unit_f64(&mut a), unit_f64(&mut stream(7, "pilot", 4)));
/// ```
pub fn stream(seed: u64, purpose: &str, shard: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&fnv1a(purpose.as_bytes()).to_le_bytes());
    key[16..].copy_from_slice(b"warpcheck stream");
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(shard);
    rng
}

/// FNV-1a, 64 bits (Fowler, Noll and Vo, RFC 9923): names a purpose by a number that no release changes.
pub(crate) fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// A uniform variate in `[0, 1)`, a multiple of 2^-53.
#[inline]
pub fn unit_f64(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// Fills `xi` with uniform variates in `[0, 1)`.
#[inline]
pub fn fill_unit(rng: &mut impl Rng, xi: &mut [f64]) {
    for x in xi {
        *x = unit_f64(rng);
    }
}

/// A variate in `[0, 1)` as `f32`, still in `[0, 1)`: rounded to nearest, and what would round up to 1 becomes
/// the largest `f32` under 1. NaN stays NaN.
///
/// ```
/// assert_eq!(1.0_f64.next_down() as f32, 1.0); // the mistake this avoids
/// assert!(warpcheck::random::to_f32(1.0_f64.next_down()) < 1.0);
/// ```
#[inline]
pub fn to_f32(xi: f64) -> f32 {
    let rounded = xi as f32;
    if rounded > ONE_MINUS_EPSILON_F32 { ONE_MINUS_EPSILON_F32 } else { rounded }
}

/// A tiny generator (SplitMix64, Steele, Lea and Flood 2014) that turns one variate into as many bits as a
/// sampler written against `rand` asks for: the same variate always gives the same bits.
#[derive(Clone, Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// Starts from the bits of one variate.
    pub fn from_variate(xi: f64) -> Self {
        let mut rng = Self(xi.to_bits());
        rng.advance(); // neighbouring variates differ in few bits
        Self(rng.advance())
    }

    fn advance(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

impl rand::TryRng for SplitMix64 {
    type Error = std::convert::Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
        Ok((self.advance() >> 32) as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
        Ok(self.advance())
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Self::Error> {
        for chunk in bytes.chunks_mut(8) {
            let word = self.advance().to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
        Ok(())
    }
}
