//! Domains by name: `hemisphere`, `interval:-1:2`, `discrete:100`.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// A domain that is named on a command line or by a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DomainName {
    /// The unit square.
    Square,
    /// The unit disk.
    Disk,
    /// A triangle of an area, 1/2 unless told.
    Triangle(f64),
    /// The upper hemisphere.
    Hemisphere,
    /// The sphere.
    Sphere,
    /// From one number to another, 0 to 1 unless told.
    Interval(f64, f64),
    /// So many entries.
    Discrete(usize),
}

impl Display for DomainName {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Square => f.write_str("square"),
            Self::Disk => f.write_str("disk"),
            Self::Triangle(area) => write!(f, "triangle:{area}"),
            Self::Hemisphere => f.write_str("hemisphere"),
            Self::Sphere => f.write_str("sphere"),
            Self::Interval(low, high) => write!(f, "interval:{low}:{high}"),
            Self::Discrete(count) => write!(f, "discrete:{count}"),
        }
    }
}

/// Entries of a discrete set, at most.
const MOST: usize = 1 << 28;

impl FromStr for DomainName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || {
            format!(
                "`{text}` is no domain; there are square, disk, triangle, triangle:AREA, hemisphere, sphere, interval:LOW:HIGH and discrete:COUNT"
            )
        };
        let words: Vec<&str> = text.split(':').collect();
        let number = |word: &str| word.parse::<f64>().ok().filter(|x| !x.is_nan()).ok_or_else(refuse);
        match words[..] {
            ["square"] => Ok(Self::Square),
            ["disk"] => Ok(Self::Disk),
            ["hemisphere"] => Ok(Self::Hemisphere),
            ["sphere"] => Ok(Self::Sphere),
            ["triangle"] => Ok(Self::Triangle(0.5)),
            ["triangle", area] => match number(area)? {
                area if area > 0.0 && area.is_finite() => Ok(Self::Triangle(area)),
                _ => Err(refuse()),
            },
            ["interval"] => Ok(Self::Interval(0.0, 1.0)),
            ["interval", low, high] => match (number(low)?, number(high)?) {
                (low, high)
                    if low < high
                        && ((high - low).is_finite() || low.is_infinite() || high.is_infinite()) =>
                {
                    Ok(Self::Interval(low, high))
                }
                _ => Err(refuse()),
            },
            ["discrete", count] => match count.parse() {
                Ok(count) if (1..=MOST).contains(&count) => Ok(Self::Discrete(count)),
                _ => Err(refuse()),
            },
            _ => Err(refuse()),
        }
    }
}

/// Runs `$body` with `$domain` being the domain of a [`DomainName`](crate::foreign::DomainName), whose type each of them has its own.
#[macro_export]
macro_rules! on_domain {
    ($name:expr, $domain:ident => $body:expr) => {
        match $name {
            $crate::foreign::DomainName::Square => {
                let $domain = $crate::domain::Square;
                $body
            }
            $crate::foreign::DomainName::Disk => {
                let $domain = $crate::domain::Disk;
                $body
            }
            $crate::foreign::DomainName::Triangle(area) => {
                let $domain = $crate::domain::Triangle::with_area(area);
                $body
            }
            $crate::foreign::DomainName::Hemisphere => {
                let $domain = $crate::domain::Hemisphere;
                $body
            }
            $crate::foreign::DomainName::Sphere => {
                let $domain = $crate::domain::Sphere;
                $body
            }
            $crate::foreign::DomainName::Interval(low, high) => {
                let $domain = $crate::domain::Interval::new(low, high);
                $body
            }
            $crate::foreign::DomainName::Discrete(count) => {
                let $domain = $crate::domain::Discrete::new(count);
                $body
            }
        }
    };
}
