//! What something costs: CPU time of the thread that does it, and wall time.
//!
//! CPU time is the POSIX clock `CLOCK_THREAD_CPUTIME_ID`: what the thread itself spent, in user and in system mode, and not what
//! it waited while others had the processor. Systems without it get wall time in its place.

use std::ops::{Add, AddAssign};
use std::time::{Duration, Instant};

/// Time that was spent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// CPU time of one thread.
    pub cpu: Duration,
    /// Time on the wall.
    pub wall: Duration,
}

impl Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { cpu: self.cpu + other.cpu, wall: self.wall + other.wall }
    }
}

impl AddAssign for Cost {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Runs from its start on; to be read by the thread that started it, and by no other.
///
/// ```
/// let clock = warpcheck::estimator::Clock::start();
/// std::thread::sleep(std::time::Duration::from_millis(20));
/// let cost = clock.read();
/// assert!(cost.wall.as_millis() >= 20);
/// # #[cfg(unix)]
/// assert!(cost.cpu < cost.wall); // sleep costs nothing
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    cpu: Option<Duration>,
    wall: Instant,
}

impl Clock {
    /// Starts at nothing.
    pub fn start() -> Self {
        Self { cpu: thread_time(), wall: Instant::now() }
    }

    /// What the calling thread has spent since.
    pub fn read(&self) -> Cost {
        let wall = self.wall.elapsed();
        let cpu = thread_time().zip(self.cpu).map_or(wall, |(now, then)| now.saturating_sub(then));
        Cost { cpu, wall }
    }
}

#[cfg(unix)]
fn thread_time() -> Option<Duration> {
    rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime).try_into().ok()
}

#[cfg(not(unix))]
fn thread_time() -> Option<Duration> {
    None
}
