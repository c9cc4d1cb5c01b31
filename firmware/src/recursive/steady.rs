//! A target without what accelerates it.

use super::state::State;

/// A target that goes on as it is.
#[derive(Clone, Copy, Debug)]
pub struct Steady {
    position_m: [f32; 3],
    /// m/s.
    pub velocity_mps: [f32; 3],
}

impl Steady {
    /// Without the acceleration of a state.
    pub fn of(state: &State<f32>) -> Self {
        Self {
            position_m: [state[0], state[1], state[2]],
            velocity_mps: [state[3], state[4], state[5]],
        }
    }

    /// Where it is `time_s` later, m.
    pub fn after(&self, time_s: f32) -> [f32; 3] {
        core::array::from_fn(|axis| self.position_m[axis] + self.velocity_mps[axis] * time_s)
    }
}
