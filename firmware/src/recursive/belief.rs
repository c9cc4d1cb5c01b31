//! What a filter knows of one target.

use super::candidate::Candidate;
use super::foresight::Foresight;
use super::memory::NOTES;
use super::target::Target;

/// What is known of one target.
#[derive(Clone, Debug)]
pub(crate) struct Belief {
    pub(crate) target: Option<Target>,
    /// Measurements in a row that the track rejected or suspected.
    pub(crate) rejections: u8,
    pub(crate) candidate: Option<Candidate>,
}

impl Belief {
    /// Nothing.
    pub const NONE: Self = Self {
        target: None,
        rejections: 0,
        candidate: None,
    };

    /// Forgets the target.
    pub fn forget(&mut self) {
        self.target = None;
        self.rejections = 0;
        self.candidate = None;
    }

    /// Knows this target from now on.
    pub fn hold(&mut self, target: &Target) {
        match &mut self.target {
            Some(held) => held.copy_from(target),
            none => first(none, target),
        }
    }

    /// Forgets what is the model's own: what its network noted for itself, and how its forecasts came
    /// true.
    pub fn forget_model(&mut self) {
        let candidate = self.candidate.as_mut().map(|c| &mut c.target);
        for target in self.target.iter_mut().chain(candidate) {
            target.memory.notes = [0.0; NOTES];
            target.foresight = Foresight::START;
        }
    }
}

/// Puts a target where there was none.
// Apart: it goes by the stack.
#[inline(never)]
fn first(place: &mut Option<Target>, target: &Target) {
    *place = Some(*target);
}
