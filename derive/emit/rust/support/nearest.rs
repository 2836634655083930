//! Selects the solution nearest to a seed, within limits. The file is the same for every robot.
#![allow(clippy::needless_range_loop)]
use crate::{math, SOLVED};

pub(crate) const FULL_TURN: f64 = 6.283185307179586;
const TURNS: f64 = 1.0 / FULL_TURN;
/// Limit violation of a coordinate that counts as rounding (rad or m).
const AT_LIMIT: f64 = 1e-12;
/// Low bits of a distance that rounding may change; a slot number replaces them.
const ROUNDING: u64 = 63;

/// The solution nearest to a seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest<const N: usize> {
    /// Coordinates, shifted by full turns towards the seed (rad or m).
    pub q: [f64; N],
    /// Distance of the pose of `q` from the target (m or rad).
    pub residual: f64,
    /// Distance from the boundary of the reachable set.
    pub margin: f64,
    /// Slot of the solution in the inverse.
    pub slot: usize,
}

/// Why an inverse has no nearest solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Missing {
    /// No solution reaches the pose; with the smallest residual and its margin.
    OutOfReach { residual: f64, margin: f64 },
    /// All solutions are outside the limits; with the smallest residual and its margin.
    OutsideLimits { residual: f64, margin: f64 },
    /// The seed or the target is not finite.
    NotFinite,
}

/// Limits, weights and periods (0 if a full turn changes the pose) of the coordinates.
pub(crate) struct Moves<'a, const N: usize> {
    pub limits: &'a [[f64; 2]; N],
    pub scale: [f64; N],
    pub turn: [f64; N],
}

/// All solutions of an inverse.
pub(crate) struct Slots<const N: usize, const K: usize> {
    pub q: [[f64; N]; K],
    pub residual: [f64; K],
    pub margin: [f64; K],
}

/// Shifts a slot by full turns to the values nearest to the seed within the limits. Returns the
/// coordinates and their distance, which is infinite if a coordinate has no value within its limits.
fn limited<const N: usize>(q: &[f64; N], q_seed: &[f64; N], by: &Moves<N>) -> ([f64; N], f64) {
    let (mut shifted, mut largest) = (*q, 0.0);
    for j in 0..N {
        let ([lower, upper], turn, own) = (by.limits[j], by.turn[j], q[j]);
        let (low, high, mut at) = (lower - AT_LIMIT, upper + AT_LIMIT, own);
        if turn > 0.0 {
            at = own - turn * math::rint((own - q_seed[j]) * TURNS);
            if at < low {
                at = own + turn * math::ceil((low - own) * TURNS);
            }
            if at > high {
                at = own - turn * math::ceil((own - high) * TURNS);
            }
        }
        if !(at >= low && at <= high) {
            return (shifted, f64::INFINITY);
        }
        shifted[j] = f64::min(f64::max(at, lower), upper);
        largest = f64::max(largest, math::abs(shifted[j] - q_seed[j]) * by.scale[j]);
    }
    (shifted, largest)
}

impl<const N: usize, const K: usize> Slots<N, K> {
    /// Returns the distance of a slot from the seed without limits.
    fn distance(&self, slot: usize, q_seed: &[f64; N], by: &Moves<N>) -> f64 {
        let mut largest = 0.0;
        for j in 0..N {
            let apart = self.q[slot][j] - q_seed[j];
            let shifted = apart - by.turn[j] * math::rint(apart * TURNS);
            let own = math::abs(shifted) * by.scale[j];
            largest = if own <= largest { largest } else { own };
        }
        if self.residual[slot] <= SOLVED {
            largest
        } else {
            f64::INFINITY
        }
    }

    /// Returns the solution nearest to the seed: the smallest largest displacement within limits,
    /// and the lowest slot if distances differ only by rounding.
    pub(crate) fn nearest(&self, q_seed: &[f64; N], by: &Moves<N>) -> Result<Nearest<N>, Missing> {
        let mut distances = [0.0; K];
        for slot in 0..K {
            distances[slot] = self.distance(slot, q_seed, by);
        }
        loop {
            let keys = (0..K).map(|slot| (distances[slot].to_bits() & !ROUNDING) | slot as u64);
            let key = keys.min().unwrap_or(u64::MAX);
            if key >= f64::INFINITY.to_bits() {
                return Err(self.missing(q_seed));
            }
            // The slot is below K; with the minimum, the compiler omits a check that could panic.
            let slot = ((key & ROUNDING) as usize).min(K - 1);
            let (q, own) = limited(&self.q[slot], q_seed, by);
            // No later solution is nearer if the limits do not increase the distance.
            if own <= distances[slot] {
                let (residual, margin) = (self.residual[slot], self.margin[slot]);
                return Ok(Nearest {
                    q,
                    residual,
                    margin,
                    slot,
                });
            }
            distances[slot] = own;
        }
    }

    fn missing(&self, q_seed: &[f64; N]) -> Missing {
        let slots = self.residual.iter().zip(&self.margin);
        let best = slots
            .filter(|own| !own.0.is_nan())
            .min_by(|a, b| a.0.total_cmp(b.0));
        match best {
            Some((&residual, &margin)) if q_seed.iter().all(|value| value.is_finite()) => {
                if residual <= SOLVED {
                    Missing::OutsideLimits { residual, margin }
                } else {
                    Missing::OutOfReach { residual, margin }
                }
            }
            _ => Missing::NotFinite,
        }
    }
}
