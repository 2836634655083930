//! Mathematical functions: those of `std`, or without the feature `std` those of C.
#![allow(dead_code, unused_imports)]

pub use functions::{atan2, cos, sin, sqrt, tan};

pub fn abs(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & !(1 << 63))
}

pub fn atan(x: f64) -> f64 {
    atan2(x, 1.0)
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
