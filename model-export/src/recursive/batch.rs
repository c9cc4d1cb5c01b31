//! Encounters side by side, laid out for the programs.

use super::carry::CARRY;
use super::encounter::Encounter;
use super::step::ARRIVAL;
use crate::autodiff::lanes::{LANES, Lanes, ZERO};

/// A group's worth of encounters: one a lane, short ones padded with steps of no weight.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Flattened start of every lane.
    pub start: Vec<Lanes>,
    /// Arrival (time step, measured flag, measurement, sigmas, what is present) of every step.
    pub arrivals: Vec<[Lanes; ARRIVAL]>,
    /// True position of every step, metres.
    pub truths_m: Vec<[Lanes; 3]>,
    /// One where the step is scored, zero in padding.
    pub weights: Vec<Lanes>,
    /// Lanes that hold an encounter of their own.
    pub used: usize,
}

impl Batch {
    /// Groups of [`LANES`] encounters in order; the last group repeats its first encounter, without
    /// weight, where there are not enough.
    pub fn groups(encounters: &[Encounter]) -> Vec<Self> {
        let of = |group| Self::of(group, longest(group));
        encounters.chunks(LANES).map(of).collect()
    }

    /// As [`Self::groups`], but every group has the steps of the longest encounter of all.
    pub fn groups_alike(encounters: &[Encounter]) -> Vec<Self> {
        let steps = longest(encounters);
        let of = |group| Self::of(group, steps);
        encounters.chunks(LANES).map(of).collect()
    }

    fn of(encounters: &[Encounter], steps: usize) -> Self {
        let mut batch = Self {
            start: vec![ZERO; CARRY],
            arrivals: vec![[ZERO; ARRIVAL]; steps],
            truths_m: vec![[ZERO; 3]; steps],
            weights: vec![ZERO; steps],
            used: encounters.len(),
        };
        for lane in 0..LANES {
            let encounter = &encounters[if lane < encounters.len() { lane } else { 0 }];
            for (slot, number) in batch.start.iter_mut().zip(encounter.start.flatten()) {
                slot[lane] = number;
            }
            for step in 0..steps {
                let within = step < encounter.arrivals.len();
                // Padding coasts on from the last step.
                let last = step.min(encounter.arrivals.len() - 1);
                let arrival = &encounter.arrivals[last];
                let slots = &mut batch.arrivals[step];
                slots[0][lane] = arrival.dt_s;
                slots[1][lane] = if within { arrival.measured } else { 0.0 };
                let vectors = &arrival.vectors;
                let parts = [vectors.measured, vectors.sigmas, vectors.present];
                for (slot, number) in slots[2..].iter_mut().zip(parts.as_flattened()) {
                    slot[lane] = *number;
                }
                for axis in 0..3 {
                    batch.truths_m[step][axis][lane] = encounter.truths_m[last][axis];
                }
                batch.weights[step][lane] = f64::from(u8::from(within && lane < encounters.len()));
            }
        }
        batch
    }

    /// Steps of the group, padding included.
    pub fn steps(&self) -> usize {
        self.arrivals.len()
    }
}

/// Steps of the longest of `encounters`.
fn longest(encounters: &[Encounter]) -> usize {
    let steps = encounters.iter().map(|e| e.arrivals.len());
    steps.max().unwrap_or(0)
}
