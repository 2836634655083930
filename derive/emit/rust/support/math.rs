//! Mathematical functions: those of `std`, or without the feature `std` those of C.
#![allow(dead_code, unused_imports)]

pub use functions::{atan2, cos, sin, sqrt, tan};

pub fn abs(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & !(1 << 63))
}

pub fn atan(x: f64) -> f64 {
    atan2(x, 1.0)
}

/// Rounds to an integer: the sum with 1.5 * 2^52 has no digits after the point.
pub fn rint(x: f64) -> f64 {
    const LARGE: f64 = 6755399441055744.0;
    if abs(x) < 2251799813685248.0 {
        (x + LARGE) - LARGE
    } else {
        x
    }
}

pub fn ceil(x: f64) -> f64 {
    let whole = rint(x);
    if whole < x {
        whole + 1.0
    } else {
        whole
    }
}

#[cfg(feature = "std")]
mod functions {
    extern crate std;

    pub fn sin(x: f64) -> f64 {
        x.sin()
    }

    pub fn cos(x: f64) -> f64 {
        x.cos()
    }

    pub fn tan(x: f64) -> f64 {
        x.tan()
    }

    pub fn sqrt(x: f64) -> f64 {
        x.sqrt()
    }

    pub fn atan2(y: f64, x: f64) -> f64 {
        y.atan2(x)
    }
}

#[cfg(not(feature = "std"))]
mod functions {
    mod c {
        extern "C" {
            pub fn sin(x: f64) -> f64;
            pub fn cos(x: f64) -> f64;
            pub fn sqrt(x: f64) -> f64;
            pub fn atan2(y: f64, x: f64) -> f64;
        }
    }

    // SAFETY of all calls: the functions of C have these arguments, and accept every number.

    pub fn sin(x: f64) -> f64 {
        unsafe { c::sin(x) }
    }

    pub fn cos(x: f64) -> f64 {
        unsafe { c::cos(x) }
    }

    pub fn tan(x: f64) -> f64 {
        sin(x) / cos(x)
    }

    pub fn sqrt(x: f64) -> f64 {
        unsafe { c::sqrt(x) }
    }

    pub fn atan2(y: f64, x: f64) -> f64 {
        unsafe { c::atan2(y, x) }
    }
}
