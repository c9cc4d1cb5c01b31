//! The two banks of models that the IMM runs with.

use serde::{Deserialize, Serialize};

use super::imm::Imm;
use super::origin::Origin;
use super::turn::Turn;

/// What is fitted of the bank of five.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FiveTurns {
    /// Fastest turn of the bank, rad/s.
    pub turn_rate_radps: f64,
    /// See [`Turn::damping_per_s`].
    pub damping_per_s: f64,
    /// See [`Turn::q_m2_s3`].
    pub q_m2_s3: f64,
}

/// Mean time a target stays with one model of either bank, s.
pub const SOJOURN_S: f64 = 3.0;

impl Imm<5> {
    /// Straight flight and turns at half and full rate to both sides.
    pub fn five(turns: &FiveTurns, origin: Origin) -> Self {
        let models = [0.0, -0.5, 0.5, -1.0, 1.0].map(|part| Turn {
            turn_rate_radps: part * turns.turn_rate_radps,
            damping_per_s: turns.damping_per_s,
            q_m2_s3: turns.q_m2_s3,
        });
        Self::new(models, SOJOURN_S, origin)
    }
}

impl Imm<10> {
    /// A wide bank that nobody tuned: straight flight from calm to violent, and turns.
    pub fn wide(origin: Origin) -> Self {
        let model = |turn_rate_radps, q_m2_s3| Turn {
            turn_rate_radps,
            damping_per_s: 0.0,
            q_m2_s3,
        };
        let models = [
            model(0.0, 0.01),
            model(0.0, 0.1),
            model(0.0, 1.0),
            model(0.0, 10.0),
            model(-0.4, 0.1),
            model(0.4, 0.1),
            model(-0.8, 0.3),
            model(0.8, 0.3),
            model(-1.6, 1.0),
            model(1.6, 1.0),
        ];
        Self::new(models, SOJOURN_S, origin)
    }
}
